"""Runs what the documents tell a reader to type, so that none of it can rot.

    run_blocks.py PROGRAM PAGE.md …             pages in this order, in one scratch folder
    run_blocks.py --pictures PROGRAM PAGE.md …  and puts the pictures that they make where the pages show them

A block is indented by four spaces or fenced (but not as ```text). It is run if a line of it begins with a command (COMMANDS below), or if it is Python.
A page says what else has to be, in comments that a reader does not see:

    <!-- before: COMMAND -->                    run first: what the page takes to be there
    <!-- not run: REASON -->                    the next block needs what a test has not (a board, root, a night)
    <!-- exits: N -->                           the next block ends with this code (0)
    <!-- file: NAME -->                         the next block is what this file holds
    <!-- makes: FILE -->                        the last block leaves this file
    <!-- picture: FILE as ../pictures/X.png --> a file that blocks above have made is the picture that the page shows

Every line of a block fenced as ```output stands in what the last block printed; `…` stands for any text.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

COMMANDS = re.compile(r"^\s*(\./rig|tunnelrig|python3|octave|sudo|dpkg|apt|git|cmake|dfu-util|openocd|build/|/usr/)\b|^\s*(build|\.)/\S")
PATIENCE_S = 240


def parts(text):
    """(kind, text, line) of a page: 'directive', 'block' or 'output', in order."""
    lines = text.split("\n")
    found, i = [], 0
    while i < len(lines):
        line, start = lines[i], i + 1
        if match := re.match(r"<!-- (.*) -->\s*$", line):
            found.append(("directive", match[1], start))
        elif match := re.match(r"```(\w*)", line):
            end = next(k for k in range(i + 1, len(lines)) if lines[k].startswith("```"))
            found.append((match[1] if match[1] in ("output", "text") else "block", "\n".join(lines[i + 1:end]), start))
            i = end
        elif line.startswith("    ") and (i == 0 or not lines[i - 1].strip()):
            end = i
            while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
                end += 1
            found.append(("block", "\n".join(text[4:] for text in lines[i:end]).rstrip(), start))
            i = end - 1
        i += 1
    return found


def script_of(block):
    """What runs a block, or None where there is nothing to run in it."""
    if re.match(r"(import|from) \w", block):
        return ["/usr/bin/python3", "-c", block]
    if any(COMMANDS.match(line) for line in block.split("\n")):
        return ["bash", "-euo", "pipefail", "-c", block]
    return None


class Page:
    def __init__(self, path, folder, pictures):
        self.path, self.folder, self.pictures = path, folder, pictures
        self.printed, self.ran, self.left_out = "", 0, []

    def fail(self, line, what):
        sys.exit(f"{self.path}:{line}: {what}\n{self.printed[-4000:]}")

    def run(self, command, line, code=0):
        try:
            done = subprocess.run(command, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True, timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.fail(line, f"not done after {PATIENCE_S} s")
        self.printed = done.stdout
        if done.returncode != code:
            self.fail(line, f"exit code {done.returncode}, not {code}: {command[-1]}")
        self.ran += 1

    def check_output(self, expected, line):
        for wanted in filter(None, map(str.strip, expected.split("\n"))):
            pattern = r"\s+".join(re.escape(word).replace("…", ".*") for word in wanted.split())
            if not re.search(pattern, self.printed):
                self.fail(line, f"is not printed: {wanted}")

    def take_picture(self, file, place, line):
        source, target = self.folder / file, (self.path.parent / place).resolve()
        if not source.is_file():
            self.fail(line, f"{file} has not been made")
        if self.pictures:
            shutil.copyfile(source, target)
        elif not target.is_file():
            self.fail(line, f"{place} is missing; run_blocks.py --pictures makes it")

    def read(self):
        reason, code, file = None, 0, None
        for kind, text, line in parts(self.path.read_text()):
            word, _, rest = text.partition(": ")
            if kind == "output":
                self.check_output(text, line)
            elif kind == "block" and file:
                (self.folder / file).parent.mkdir(exist_ok=True)
                (self.folder / file).write_text(text + "\n")
                file = None
            elif kind == "block":
                if (script := script_of(text)) is None:
                    continue
                if reason:
                    self.left_out.append(f"{self.path.name}:{line}: {reason}")
                else:
                    self.run(script, line, code)
                reason, code = None, 0
            elif word == "before":
                self.run(["bash", "-euo", "pipefail", "-c", rest], line)
            elif word == "not run":
                reason = rest
            elif word == "file":
                file = rest
            elif word == "exits":
                code = int(rest)
            elif word == "makes":
                if not (self.folder / rest).exists():
                    self.fail(line, f"{rest} has not been made")
            elif word == "picture":
                self.take_picture(*rest.split(" as "), line)


def main():
    arguments = sys.argv[1:]
    pictures = arguments[0] == "--pictures"
    program, *pages = [pathlib.Path(argument).resolve() for argument in arguments[pictures:]]
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        # What a reader has: the launcher in the folder, the program on the path.
        rig = folder / "rig"
        rig.write_text(f'#!/bin/sh\nexec "{program}" "$@"\n')
        rig.chmod(0o755)
        os.environ["PATH"] = f"{program.parent}:{os.environ['PATH']}"
        for path in pages:
            page = Page(path, folder, pictures)
            page.read()
            print(f"{path.name}: {page.ran} blocks run, {len(page.left_out)} left out")
            for left_out in page.left_out:
                print(f"  {left_out}")


if __name__ == "__main__":
    main()

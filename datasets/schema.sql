-- The campaign file: one SQLite data base that holds one campaign, raw data and everything derived from it.
--
-- This file is the schema and its history. It is cut at the lines "-- @version N"; a new file runs all parts, an older one
-- the parts above its PRAGMA user_version, each in one transaction. A part that has been released is never edited.
-- The file is in WAL mode with synchronous = FULL. Times are ISO 8601, UTC. Hashes are described in docs/campaign-file.md.

-- @version 1

PRAGMA application_id = 0x54524947;  -- "TRIG"

-- Documents that arrived as text and are given back verbatim: 'campaign.toml' or 'table.toml'.
CREATE TABLE texts (
  name TEXT PRIMARY KEY,
  text TEXT NOT NULL
) WITHOUT ROWID;

-- CSV files as they stood, cell by cell: 'runs', 'calibration', 'propellers', 'observations'.
CREATE TABLE sheets (
  sheet   TEXT PRIMARY KEY,
  columns TEXT NOT NULL CHECK (json_type(columns) = 'array')
) WITHOUT ROWID;

CREATE TABLE sheet_rows (
  sheet TEXT NOT NULL REFERENCES sheets (sheet) ON DELETE CASCADE,
  row   INTEGER NOT NULL,              -- from 0, in the file's order
  cells TEXT NOT NULL CHECK (json_type(cells) = 'array'),
  PRIMARY KEY (sheet, row)
) WITHOUT ROWID;

-- One row per run that has raw data; the rest of what is known of a run is its row of sheet 'runs'.
CREATE TABLE raw_runs (
  id          INTEGER PRIMARY KEY CHECK (id BETWEEN 1 AND 2147483647),
  run         TEXT NOT NULL UNIQUE,
  state       TEXT NOT NULL CHECK (state IN ('recording', 'complete', 'partial')),
  sample_type TEXT NOT NULL CHECK (sample_type IN ('int16', 'uint16', 'float32', 'float64')),
  channels    INTEGER NOT NULL CHECK (channels BETWEEN 1 AND 4),
  frames      INTEGER NOT NULL DEFAULT 0,   -- stored so far
  hash        TEXT NOT NULL DEFAULT ''      -- of format, frames and gaps; empty while recording
);

-- The frames, in blobs of at most 0.1 s: frames x channels samples, little-endian.
-- The key is raw_runs.id << 32 | index of the blob's first frame, so that a run is one range of one tree.
CREATE TABLE raw_chunks (
  id     INTEGER PRIMARY KEY,
  crc32c INTEGER NOT NULL,                  -- of data
  data   BLOB NOT NULL
);

-- The loss ledger's entries: frames that were sampled and did not arrive.
CREATE TABLE gaps (
  id          INTEGER PRIMARY KEY,          -- order of occurrence
  raw_run     INTEGER NOT NULL REFERENCES raw_runs (id) ON DELETE CASCADE,
  first_frame INTEGER NOT NULL,             -- index of the first stored frame after the gap
  frames_lost INTEGER NOT NULL CHECK (frames_lost > 0),
  cause       TEXT NOT NULL DEFAULT '',     -- lost, overrun, adc-error, reboot, unplugged, silent, usb-…; empty: imported without one
  estimated   INTEGER NOT NULL DEFAULT 0    -- 1: the length comes from a clock
);
CREATE INDEX gaps_by_run ON gaps (raw_run);

-- The loss ledger's sums: frames_emitted = frames_stored + frames_lost, kept true at every commit.
CREATE TABLE ledgers (
  raw_run           INTEGER PRIMARY KEY REFERENCES raw_runs (id) ON DELETE CASCADE,
  frames_emitted    INTEGER NOT NULL,
  frames_stored     INTEGER NOT NULL,
  frames_lost       INTEGER NOT NULL,
  frames_duplicate  INTEGER NOT NULL,       -- arrived again and dropped
  frames_late       INTEGER NOT NULL,       -- arrived after a later frame and dropped (they count as lost)
  packets_corrupt   INTEGER NOT NULL,
  bytes_skipped     INTEGER NOT NULL,       -- while looking for the next packet
  frames_overrun    INTEGER NOT NULL,       -- frames flagged "overrun before this one"
  frames_adc_error  INTEGER NOT NULL,
  reboots           INTEGER NOT NULL,
  silences          INTEGER NOT NULL,       -- times the source said nothing for a second
  boot_id           INTEGER NOT NULL,       -- of the first frame
  first_sequence    INTEGER NOT NULL,
  board_rate_hz     REAL,                   -- frames per second: fitted against the computer's clock, or as the board says
  rate_interval_hz  REAL,                   -- half of the fitted rate's 95 % interval; null where it was not fitted
  drift_ppm_h       REAL,                   -- change of the fitted rate
  drift_interval_ppm_h REAL,
  end_reason        TEXT NOT NULL DEFAULT '',
  source            TEXT NOT NULL DEFAULT ''
);

-- Statistics of a run's channels, computed once from the raw data with this hash (voltages).
CREATE TABLE run_statistics (
  raw_run          INTEGER NOT NULL REFERENCES raw_runs (id) ON DELETE CASCADE,
  channel          INTEGER NOT NULL CHECK (channel BETWEEN 1 AND 4),
  hash             TEXT NOT NULL,
  frames           INTEGER NOT NULL,
  mean_V           REAL NOT NULL,
  std_V            REAL NOT NULL,
  standard_error_V REAL NOT NULL,           -- of the mean, autocorrelation included
  drift_V          REAL NOT NULL,           -- fitted line, end minus start
  drift_z          REAL NOT NULL,           -- drift over its own standard error
  lowest_V         REAL NOT NULL,
  highest_V        REAL NOT NULL,
  clipped          INTEGER NOT NULL,        -- samples at the end of the converter's range
  shaft_hz         REAL,                    -- the shaft line, a second tachometer
  PRIMARY KEY (raw_run, channel)
) WITHOUT ROWID;

-- Lines of a run's spectrum.
CREATE TABLE run_lines (
  raw_run      INTEGER NOT NULL REFERENCES raw_runs (id) ON DELETE CASCADE,
  channel      INTEGER NOT NULL,
  frequency_hz REAL NOT NULL,
  amplitude_V  REAL NOT NULL,               -- peak amplitude of the sinusoid
  prominence   REAL NOT NULL,               -- power over the noise around it
  name         TEXT NOT NULL,               -- shaft, blade_pass, mains_50, …, or empty
  PRIMARY KEY (raw_run, channel, frequency_hz)
) WITHOUT ROWID;

-- Means of consecutive windows within a run: float64, windows x channels; NaN where all frames were lost.
CREATE TABLE run_windows (
  raw_run  INTEGER PRIMARY KEY REFERENCES raw_runs (id) ON DELETE CASCADE,
  window_s REAL NOT NULL,
  means_V  BLOB NOT NULL
);

-- Everything derived, each with what it was made from. The newest of a kind is the one in force.
CREATE TABLE documents (
  id              INTEGER PRIMARY KEY,
  kind            TEXT NOT NULL,            -- calibration, reduction, map, model, …
  created_utc     TEXT NOT NULL,
  program_version TEXT NOT NULL,
  arguments       TEXT NOT NULL,            -- the command line
  inputs          TEXT NOT NULL CHECK (json_type(inputs) = 'object'),  -- ids and hashes of what it depends on
  document        TEXT NOT NULL CHECK (json_valid(document))
);
CREATE INDEX documents_by_kind ON documents (kind, id);

-- @version 2

-- Frames that the board flags: a channel at the end of the converter's range; a test pattern, no measurement.
ALTER TABLE ledgers ADD COLUMN frames_clipped INTEGER NOT NULL DEFAULT 0;
ALTER TABLE ledgers ADD COLUMN frames_test_pattern INTEGER NOT NULL DEFAULT 0;

-- @version 3

-- The board that was recorded, where its source knows: its serial number, and of how many conversions it made a frame.
ALTER TABLE ledgers ADD COLUMN board_serial TEXT NOT NULL DEFAULT '';
ALTER TABLE ledgers ADD COLUMN conversions_per_frame INTEGER NOT NULL DEFAULT 0;

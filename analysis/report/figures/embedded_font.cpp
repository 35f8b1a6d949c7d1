#include "analysis/report/figures/embedded_font.h"

#include <memory>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <hb-subset.h>

namespace tunnelrig::report {
namespace {

struct FontFile {
  std::string family, path;
  unsigned face = 0;  // of a collection
};

template <auto destroy>
struct Destroy {
  template <typename T>
  void operator()(T* handle) const {
    destroy(handle);
  }
};
template <typename T, auto destroy>
using Handle = std::unique_ptr<T, Destroy<destroy>>;

std::optional<FontFile> sans() {
  const Handle<FcConfig, FcConfigDestroy> config(FcInitLoadConfigAndFonts());
  const Handle<FcPattern, FcPatternDestroy> wanted(FcNameParse(reinterpret_cast<const FcChar8*>("sans")));
  if (!config || !wanted) return {};
  FcConfigSubstitute(config.get(), wanted.get(), FcMatchPattern);
  FcDefaultSubstitute(wanted.get());
  FcResult result = FcResultNoMatch;
  const Handle<FcPattern, FcPatternDestroy> found(FcFontMatch(config.get(), wanted.get(), &result));
  FcChar8 *path = nullptr, *family = nullptr;
  int face = 0;
  if (!found || FcPatternGetString(found.get(), FC_FILE, 0, &path) != FcResultMatch ||
      FcPatternGetString(found.get(), FC_FAMILY, 0, &family) != FcResultMatch)
    return {};
  FcPatternGetInteger(found.get(), FC_INDEX, 0, &face);
  return FontFile{reinterpret_cast<const char*>(family), reinterpret_cast<const char*>(path),
                  static_cast<unsigned>(face)};
}

/// Looked for once.
const std::optional<FontFile>& figure_font() {
  static const std::optional<FontFile> font = sans();
  return font;
}

/// Of the whole file, tags too: letters and digits are wanted anyway, and beyond ASCII only texts have any.
void add_characters(std::string_view svg, hb_set_t* characters) {
  hb_set_add_range(characters, ' ', '~');
  const Handle<hb_buffer_t, hb_buffer_destroy> buffer(hb_buffer_create());
  hb_buffer_add_utf8(buffer.get(), svg.data(), static_cast<int>(svg.size()), 0, static_cast<int>(svg.size()));
  unsigned count = 0;
  const hb_glyph_info_t* infos = hb_buffer_get_glyph_infos(buffer.get(), &count);
  for (unsigned i = 0; i < count; ++i) {
    if (infos[i].codepoint > '~') hb_set_add(characters, infos[i].codepoint);
  }
}

/// The font with nothing but these glyphs; empty where its file cannot be read or cut.
std::string subset(const FontFile& font, std::string_view svg) {
  const Handle<hb_blob_t, hb_blob_destroy> file(hb_blob_create_from_file_or_fail(font.path.c_str()));
  const Handle<hb_subset_input_t, hb_subset_input_destroy> input(hb_subset_input_create_or_fail());
  if (!file || !input) return {};
  const Handle<hb_face_t, hb_face_destroy> face(hb_face_create(file.get(), font.face));
  hb_subset_input_set_flags(input.get(), HB_SUBSET_FLAGS_NO_HINTING);  // pictures are drawn at any size
  add_characters(svg, hb_subset_input_unicode_set(input.get()));
  const Handle<hb_face_t, hb_face_destroy> small(hb_subset_or_fail(face.get(), input.get()));
  if (!small) return {};
  const Handle<hb_blob_t, hb_blob_destroy> blob(hb_face_reference_blob(small.get()));
  unsigned size = 0;
  const char* data = hb_blob_get_data(blob.get(), &size);
  return {data, size};
}

/// RFC 4648.
std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned three = 0;
    for (std::size_t j = i; j < i + 3; ++j)
      three = three << 8u | (j < bytes.size() ? static_cast<unsigned char>(bytes[j]) : 0u);
    for (std::size_t digit = 0; digit < 4; ++digit)
      text += i + digit > bytes.size() ? '=' : kDigits[three >> (18 - 6 * digit) & 63u];
  }
  return text;
}

}  // namespace

std::string figure_font_family() { return figure_font() ? figure_font()->family : "sans-serif"; }

std::string with_embedded_font(std::string svg) {
  if (!figure_font()) return svg;
  const std::string font = subset(*figure_font(), svg);
  const auto root = svg.find("<svg");
  const auto inside = svg.find('>', root);
  if (font.empty() || root == std::string::npos || inside == std::string::npos) return svg;
  return svg.insert(
      inside + 1,
      fmt::format("\n<style>@font-face {{ font-family: \"{}\"; src: url(data:font/ttf;base64,{}) }}</style>",
                  figure_font()->family, base64(font)));
}

}  // namespace tunnelrig::report

// A bitmap font for printable ASCII in cells of 6 x 10 pixels.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tactus::render {

inline constexpr int kGlyphWidth = 6, kGlyphHeight = 10;
inline constexpr char kGlyphFirst = ' ', kGlyphLast = '~';
inline constexpr int kGlyphsCount = kGlyphLast - kGlyphFirst + 1;

/// For each glyph its rows from the top, two hexadecimal digits a row: bit 4 is the left one of five pixels.
/// Rows begin at the cell's second; the eighth and ninth hang below the line. The cell's right column and
/// last row stay clear.
inline constexpr std::array<std::string_view, kGlyphsCount> kGlyphRows = {
    "",
    "04040404040004",
    "0A0A0A",
    "0A0A1F0A1F0A0A",
    "040F140E051E04",
    "18190204081303",
    "0C12140815120D",
    "040408",
    "02040808080402",
    "08040202020408",
    "0004150E150400",
    "0004041F040400",
    "00000000000C0408",
    "0000001F000000",
    "00000000000C0C",
    "00010204081000",
    "0E11131519110E",
    "040C040404040E",
    "0E11010204081F",
    "1F02040201110E",
    "02060A121F0202",
    "1F101E0101110E",
    "0608101E11110E",
    "1F010204080808",
    "0E11110E11110E",
    "0E11110F01020C",
    "000C0C000C0C00",
    "000C0C000C0408",
    "02040810080402",
    "00001F001F0000",
    "08040201020408",
    "0E110102040004",
    "0E11010D15150E",
    "0E11111F111111",
    "1E11111E11111E",
    "0E11101010110E",
    "1C12111111121C",
    "1F10101E10101F",
    "1F10101E101010",
    "0E11101711110F",
    "1111111F111111",
    "0E04040404040E",
    "0702020202120C",
    "11121418141211",
    "1010101010101F",
    "111B1515111111",
    "11111915131111",
    "0E11111111110E",
    "1E11111E101010",
    "0E11111115120D",
    "1E11111E141211",
    "0F10100E01011E",
    "1F040404040404",
    "1111111111110E",
    "11111111110A04",
    "1111111515150A",
    "11110A040A1111",
    "1111110A040404",
    "1F01020408101F",
    "0E08080808080E",
    "00100804020100",
    "0E02020202020E",
    "040A11",
    "000000000000001F",
    "080402",
    "00000E010F110F",
    "1010161911111E",
    "00000E1010110E",
    "01010D1311110F",
    "00000E111F100E",
    "0609081C080808",
    "00000F1111110F010E",
    "10101619111111",
    "04000C0404040E",
    "02000602020202120C",
    "10101214181412",
    "0C04040404040E",
    "00001A15151111",
    "00001619111111",
    "00000E1111110E",
    "00001E1111111E1010",
    "00000F1111110F0101",
    "00001619101010",
    "00000E100E011E",
    "08081C08080906",
    "0000111111130D",
    "00001111110A04",
    "0000111115150A",
    "0000110A040A11",
    "0000111111110F010E",
    "00001F0204081F",
    "02040408040402",
    "04040404040404",
    "08040402040408",
    "00000815020000",
};

/// Whether a pixel of the glyph's cell is ink; characters without a glyph look like '?'.
constexpr bool glyph_ink(char character, int x, int y) {
  if (character < kGlyphFirst || character > kGlyphLast) character = '?';
  const std::string_view rows = kGlyphRows[static_cast<std::size_t>(character - kGlyphFirst)];
  const int row = y - 1;
  if (x < 0 || x > 4 || row < 0 || 2 * row + 1 >= static_cast<int>(rows.size())) return false;
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'A' + 10; };
  const int bits = 16 * digit(rows[static_cast<std::size_t>(2 * row)]) +
                   digit(rows[static_cast<std::size_t>(2 * row + 1)]);
  return ((bits >> (4 - x)) & 1) != 0;
}

}  // namespace tactus::render

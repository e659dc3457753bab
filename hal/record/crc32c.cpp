#include "hal/record/crc32c.hpp"

#include <array>
#include <cstddef>
#include <cstring>

#include "hal/record/little_endian.hpp"

#if defined(__aarch64__)
#include <sys/auxv.h>
#endif

namespace tactus::hal::record {
namespace {

using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// Slicing by 8 (Kounavis and Berry 2008): table k holds what a byte does to the checksum k bytes later.
constexpr Tables make_tables() {
  constexpr std::uint32_t kPolynomial = 0x82F63B78;  // 0x1EDC6F41 with its bits in the order of transmission
  Tables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? kPolynomial : 0);
    tables[0][i] = crc;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t i = 0; i < 256; ++i)
      tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 255];
  return tables;
}
constexpr Tables kTables = make_tables();

std::uint64_t load8(const std::uint8_t* at) {
  std::uint64_t value = 0;
  std::memcpy(&value, at, sizeof value);
  return value;
}

#if defined(__x86_64__)
#define TACTUS_HAS_CRC32C 1
__attribute__((target("sse4.2"))) std::uint32_t by_instruction(const std::uint8_t* at, std::size_t count,
                                                               std::uint32_t crc) {
  std::uint64_t wide = crc;
  for (; count >= 8; at += 8, count -= 8) wide = __builtin_ia32_crc32di(wide, load8(at));
  crc = static_cast<std::uint32_t>(wide);
  for (; count > 0; ++at, --count) crc = __builtin_ia32_crc32qi(crc, *at);
  return crc;
}
bool find_instruction() { return __builtin_cpu_supports("sse4.2") != 0; }
#elif defined(__aarch64__)
#define TACTUS_HAS_CRC32C 1
// In assembler: GCC and clang name the builtin differently, and arm_acle.h shows it only when all code may use it.
std::uint32_t by_instruction(const std::uint8_t* at, std::size_t count, std::uint32_t crc) {
  for (; count >= 8; at += 8, count -= 8)
    asm(".arch_extension crc\n\tcrc32cx %w0, %w0, %x1" : "+r"(crc) : "r"(load8(at)));
  for (; count > 0; ++at, --count)
    asm(".arch_extension crc\n\tcrc32cb %w0, %w0, %w1" : "+r"(crc) : "r"(std::uint32_t{*at}));
  return crc;
}
bool find_instruction() {
  constexpr unsigned long kCrc32 = 1UL << 7;  // HWCAP_CRC32
  return (getauxval(AT_HWCAP) & kCrc32) != 0;
}
#else
bool find_instruction() { return false; }
#endif

}  // namespace

bool has_crc32c_instruction() {
  static const bool has = find_instruction();
  return has;
}

std::uint32_t crc32c_by_tables(std::span<const std::uint8_t> bytes, std::uint32_t before) {
  const std::uint8_t* at = bytes.data();
  std::size_t count = bytes.size();
  std::uint32_t crc = ~before;
  for (; count >= 8; at += 8, count -= 8) {
    const std::uint64_t x = load8(at) ^ crc;
    crc = 0;
    for (std::size_t k = 0; k < 8; ++k) crc ^= kTables[7 - k][(x >> (8 * k)) & 255];
  }
  for (; count > 0; ++at, --count) crc = (crc >> 8) ^ kTables[0][(crc ^ *at) & 255];
  return ~crc;
}

std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t before) {
#if defined(TACTUS_HAS_CRC32C)
  if (has_crc32c_instruction()) return ~by_instruction(bytes.data(), bytes.size(), ~before);
#endif
  return crc32c_by_tables(bytes, before);
}

}  // namespace tactus::hal::record

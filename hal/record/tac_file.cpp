#include "hal/record/tac_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "hal/record/crc32c.hpp"
#include "hal/record/little_endian.hpp"

namespace tactus::hal::record {
namespace {

bool is_indexed(ChunkType type) {
  return type == ChunkType::depth || type == ChunkType::color || type == ChunkType::labels || type == ChunkType::truth;
}

rt::Error bad_input(const std::filesystem::path& path, const std::string& what) {
  return {rt::ExitCode::bad_input, path.string() + ": " + what};
}

/// Where the mark starts in `bytes`, or their number.
std::size_t find_mark(std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, 4> mark{};
  put(mark.data(), kMark);
  return static_cast<std::size_t>(std::search(bytes.begin(), bytes.end(), mark.begin(), mark.end()) - bytes.begin());
}

}  // namespace

TacFile::TacFile(std::filesystem::path path, int descriptor, std::uint64_t bytes)
    : path_(std::move(path)), descriptor_(descriptor), bytes_(bytes) {}
TacFile::~TacFile() { close(descriptor_); }

bool TacFile::read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  if (offset > bytes_ || bytes.size() > bytes_ - offset) return false;
  while (!bytes.empty()) {
    const ssize_t got = pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    offset += static_cast<std::uint64_t>(got);
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

std::optional<ChunkHeader> TacFile::header_at(std::uint64_t offset) const {
  ChunkHeaderBytes bytes{};
  return read_at(offset, bytes) ? decode_chunk_header(bytes) : std::nullopt;
}

std::size_t TacFile::chunk_bytes(const IndexEntry& entry) {
  const std::uint64_t payload_bytes = entry.header.payload_bytes;
  return payload_bytes > kPayloadBytesMax ? 0 : kChunkHeaderBytes + static_cast<std::size_t>(payload_bytes);
}

const char* TacFile::read_chunk(const IndexEntry& entry, std::span<std::uint8_t> buffer,
                                std::span<const std::uint8_t>& payload) const {
  const std::size_t count = chunk_bytes(entry);
  if (count == 0) return "is larger than 64 MiB";
  const auto chunk = buffer.first(count);
  if (!read_at(entry.offset, chunk)) return "cannot be read";
  const ChunkHeaderBytes expected = encode(entry.header);
  payload = chunk.subspan(kChunkHeaderBytes);
  if (!std::equal(expected.begin(), expected.end(), chunk.begin()) || crc32c(payload) != entry.header.payload_crc)
    return "does not match its checksum";
  return nullptr;
}

std::optional<std::vector<std::uint8_t>> TacFile::payload_of(const IndexEntry& entry) const {
  if (chunk_bytes(entry) == 0 || chunk_bytes(entry) > bytes_) return std::nullopt;
  std::vector<std::uint8_t> buffer(chunk_bytes(entry));
  std::span<const std::uint8_t> payload;
  if (read_chunk(entry, buffer, payload) != nullptr) return std::nullopt;
  return std::vector<std::uint8_t>(payload.begin(), payload.end());
}

rt::Result<void> TacFile::read_file_header() {
  std::array<std::uint8_t, kMagicBytes> magic{};
  if (!read_at(0, magic) || !std::equal(magic.begin(), magic.begin() + kVersionAt, kMagic.begin()))
    return bad_input(path_, "is no recording of tactus (it does not begin as one)");
  const std::uint8_t* version_at = magic.data() + kVersionAt;
  if (const auto version = take<std::uint32_t>(version_at); version != kVersion)
    return bad_input(path_, "is a recording of version " + std::to_string(version) +
                                ", and this program reads version 1; use the program that wrote it or a newer one");
  const auto header = header_at(kMagicBytes);
  if (!header || header->type != ChunkType::header)
    return bad_input(path_, bytes_ <= kMagicBytes + kChunkHeaderBytes
                                ? "ends before it says what was recorded"
                                : "the beginning, which says what was recorded, is damaged");
  const auto text = payload_of({kMagicBytes, *header});
  if (!text) return bad_input(path_, "the description of what was recorded is damaged or cut off");
  auto parsed = parse_file_header({reinterpret_cast<const char*>(text->data()), text->size()}, path_.string());
  if (!parsed) return parsed.error();
  header_ = std::move(*parsed);
  first_offset_ = kMagicBytes + kChunkHeaderBytes + header->payload_bytes;
  return {};
}

void TacFile::find_end() {
  if (bytes_ < first_offset_ + kEndChunkBytes) return;
  const auto header = header_at(bytes_ - kEndChunkBytes);
  if (!header || header->type != ChunkType::end || header->payload_bytes != kEndPayloadBytes) return;
  const auto payload = payload_of({bytes_ - kEndChunkBytes, *header});
  if (payload) end_ = decode_end(std::span(*payload).first<kEndPayloadBytes>());
}

/// From the last index to the first; false, and nothing kept, when one of them is damaged.
bool TacFile::read_index() {
  std::vector<std::vector<IndexEntry>> parts;
  std::uint64_t before = bytes_ - kEndChunkBytes;  // offsets only fall on the way: no circles
  for (std::uint64_t offset = end_->last_index_offset; offset != 0;) {
    if (offset < first_offset_ || offset >= before) return false;
    const auto header = header_at(offset);
    if (!header || header->type != ChunkType::index) return false;
    const auto payload = payload_of({offset, *header});
    if (!payload || payload->size() % kIndexEntryBytes != 8) return false;
    const std::uint8_t* at = payload->data();
    const auto next = take<std::uint64_t>(at);
    std::vector<IndexEntry>& part = parts.emplace_back();
    while (at != payload->data() + payload->size()) {
      const auto start = take<std::uint64_t>(at);
      const auto entry = decode_chunk_header(std::span<const std::uint8_t, kChunkHeaderBytes>(at, kChunkHeaderBytes));
      at += kChunkHeaderBytes;
      const bool is_behind = part.empty() || start > part.back().offset;
      if (!entry || !is_indexed(entry->type) || !is_behind || start < first_offset_ || start >= offset ||
          entry->payload_bytes > offset - start)
        return false;
      part.push_back({start, *entry});
    }
    before = part.empty() ? offset : part.front().offset;
    offset = next;
  }
  for (auto part = parts.rbegin(); part != parts.rend(); ++part)
    entries_.insert(entries_.end(), part->begin(), part->end());
  chunks_count_ = end_->chunks_count + 1;
  return true;
}

/// The next place where a header stands whose checksum fits; the end of the file when there is none.
std::uint64_t TacFile::next_chunk_after(std::uint64_t offset) const {
  constexpr std::size_t kWindowBytes = 1 << 16;
  std::vector<std::uint8_t> window(kWindowBytes);
  for (std::uint64_t at = offset; at + kChunkHeaderBytes <= bytes_;) {
    const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(kWindowBytes, bytes_ - at));
    const auto bytes = std::span(window).first(count);
    if (!read_at(at, bytes)) break;
    const std::size_t found = find_mark(bytes);
    if (found == count) {
      at += count == kWindowBytes ? count - 3 : count;  // the mark may begin in the window's last three bytes
      continue;
    }
    at += found;
    if (header_at(at)) return at;
    ++at;
  }
  return bytes_;
}

void TacFile::scan() {
  chunks_count_ = 1;
  std::uint64_t holes_count = 0, holes_bytes = 0, first_hole = 0;
  std::uint64_t at = first_offset_;
  while (at < bytes_) {
    const auto header = header_at(at);
    if (header && header->payload_bytes > bytes_ - at - kChunkHeaderBytes) break;  // the torn one at the end
    if (header) {
      if (is_indexed(header->type)) entries_.push_back({at, *header});
      ++chunks_count_;
      at += kChunkHeaderBytes + header->payload_bytes;
      continue;
    }
    const std::uint64_t next = next_chunk_after(at + 1);
    if (next == bytes_) break;
    if (holes_count++ == 0) first_hole = at;
    holes_bytes += next - at;
    at = next;
  }
  damaged_bytes_ = holes_bytes + (bytes_ - at);
  if (holes_count > 0)
    notes_.push_back(path_.string() + ": " + std::to_string(holes_bytes) + " bytes in " + std::to_string(holes_count) +
                     " places, first at byte " + std::to_string(first_hole) +
                     ", belong to no chunk and are passed over");
}

/// After a power cut the file can be longer than what reached the disk: chunks at its very end whose header is there and
/// whose pixels are not.
void TacFile::drop_unwritten_tail() {
  while (!entries_.empty() && !payload_of(entries_.back())) {
    damaged_bytes_ += kChunkHeaderBytes + entries_.back().header.payload_bytes;
    --chunks_count_;
    entries_.pop_back();
  }
}

void TacFile::read_truth() {
  std::uint64_t rejected_count = 0;
  for (const IndexEntry& entry : entries_) {
    if (entry.header.type != ChunkType::truth) continue;
    const auto payload = payload_of(entry);
    if (!payload || payload->size() % kPoseBytes != 0) {
      notes_.push_back(path_.string() + ": a part of the true poses is damaged and left out");
      continue;
    }
    for (const std::uint8_t* at = payload->data(); at != payload->data() + payload->size();) {
      TruthPose pose{{take<std::int64_t>(at)}, {}};
      for (double& value : pose.T_world_depth.rotation.m) value = take<double>(at);
      Vec3d& t = pose.T_world_depth.translation;
      for (double* value : {&t.x, &t.y, &t.z}) *value = take<double>(at);
      const bool is_sound = pose.T_world_depth.is_finite() && (truth_.empty() || truth_.back().time < pose.time);
      if (is_sound)
        truth_.push_back(pose);
      else
        ++rejected_count;
    }
  }
  if (rejected_count > 0)
    notes_.push_back(path_.string() + ": " + std::to_string(rejected_count) +
                     " true poses are not finite or not later than the one before, and left out");
}

rt::Result<std::shared_ptr<const TacFile>> TacFile::open(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe would wait for a writer
  if (descriptor < 0) return bad_input(path, std::string("cannot be opened: ") + std::strerror(errno));
  struct stat facts {};
  const bool is_file = fstat(descriptor, &facts) == 0 && S_ISREG(facts.st_mode);
  const std::shared_ptr<TacFile> file(
      new TacFile(path, descriptor, is_file ? static_cast<std::uint64_t>(facts.st_size) : 0));
  if (!is_file) return bad_input(path, "not a regular file");
  if (auto read = file->read_file_header(); !read) return read.error();
  file->find_end();
  if (!file->end_ || !file->read_index()) {
    file->scan();
    if (file->end_) {
      file->notes_.push_back(path.string() + ": the index is damaged; the chunks were looked for one by one");
    } else {
      file->drop_unwritten_tail();
      file->notes_.push_back(path.string() + ": the recording was cut off; it is played up to its last whole chunk");
    }
  }
  file->read_truth();
  return std::shared_ptr<const TacFile>(file);
}

}  // namespace tactus::hal::record

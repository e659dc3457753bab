#include "hal/record/chunk_file.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hal/record/crc32c.hpp"
#include "hal/record/little_endian.hpp"

namespace tactus::hal::record {
namespace {

/// On this thread, within this scope, a write beyond the size that a file may have (ulimit -f) fails instead of ending the
/// program.
class FileSizeGuard {
 public:
  FileSizeGuard() noexcept {
    sigemptyset(&signal_);
    sigaddset(&signal_, SIGXFSZ);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGXFSZ) == 1;
    pthread_sigmask(SIG_BLOCK, &signal_, &before_);
  }
  ~FileSizeGuard() {
    if (sigismember(&before_, SIGXFSZ) == 1) return;
    constexpr timespec kAtOnce{};
    if (!was_pending_) sigtimedwait(&signal_, nullptr, &kAtOnce);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  FileSizeGuard(const FileSizeGuard&) = delete;
  FileSizeGuard& operator=(const FileSizeGuard&) = delete;

 private:
  sigset_t signal_, before_;
  bool was_pending_ = false;
};

iovec part(std::span<const std::uint8_t> bytes) {
  // writev only reads, but is declared for both directions.
  return {const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
}

rt::Error cannot_write(const std::filesystem::path& path, int error) {
  return {rt::ExitCode::failed, path.string() + ": cannot be written (" + std::strerror(error) +
                                    "); is the disk full, or the folder read-only?"};
}

void sync_folder_of(const std::filesystem::path& path) {
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);  // some file systems cannot, and need not
  close(descriptor);
}

}  // namespace

ChunkFile::ChunkFile(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {
  index_.reserve(8 + kIndexEntries * kIndexEntryBytes);
  index_.resize(8);
}

ChunkFile::~ChunkFile() { close(descriptor_); }

rt::Result<std::unique_ptr<ChunkFile>> ChunkFile::create(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0 && errno == EEXIST)
    return rt::Error{rt::ExitCode::bad_usage, path.string() + ": exists; name a new file for the recording"};
  if (descriptor < 0) return cannot_write(path, errno);
  std::unique_ptr<ChunkFile> file(new ChunkFile(path, descriptor));
  if (!file->write(kMagic, {})) return rt::Error{rt::ExitCode::failed, file->failure()};
  sync_folder_of(path);
  return file;
}

/// Keeps the first reason, and cuts off what stands of the torn chunk.
bool ChunkFile::fail(int error) {
  (void)!ftruncate(descriptor_, static_cast<off_t>(end_));
  if (!failure_.empty()) return false;
  const char* advice = error == ENOSPC || error == EDQUOT ? "make room on the disk or name another"
                       : error == EFBIG                   ? "raise the limit (ulimit -f) or name another disk"
                                                          : "look at the disk or name another";
  failure_ = path_.string() + ": cannot be written any further (" + std::strerror(error) +
             "); the recording ends here and what it holds can be played; " + advice;
  return false;
}

bool ChunkFile::write(std::span<const std::uint8_t> first, std::span<const std::uint8_t> second) {
  const FileSizeGuard guard;
  std::uint64_t at = end_;
  while (!first.empty() || !second.empty()) {
    const std::array<iovec, 2> parts{part(first), part(second)};
    const ssize_t got = pwritev(descriptor_, parts.data(), parts.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return fail(got < 0 ? errno : ENOSPC);
    at += static_cast<std::uint64_t>(got);
    const std::size_t of_first = std::min(first.size(), static_cast<std::size_t>(got));
    first = first.subspan(of_first);
    second = second.subspan(static_cast<std::size_t>(got) - of_first);
  }
  end_ = at;
  return true;
}

bool ChunkFile::write_chunk(ChunkHeader header, std::span<const std::uint8_t> payload) {
  header.payload_bytes = payload.size();
  header.payload_crc = crc32c(payload);
  const std::uint64_t offset = end_;
  const ChunkHeaderBytes bytes = encode(header);
  if (!write(bytes, payload)) return false;
  ++chunks_count_;
  if (header.type == ChunkType::header || header.type == ChunkType::index || header.type == ChunkType::end) return true;
  index_.resize(index_.size() + 8);
  put(index_.data() + index_.size() - 8, offset);
  index_.insert(index_.end(), bytes.begin(), bytes.end());
  return true;
}

bool ChunkFile::append(ChunkHeader header, std::span<const std::uint8_t> payload) {
  if (!failure_.empty() || !write_chunk(header, payload)) return false;
  return index_.size() < 8 + kIndexEntries * kIndexEntryBytes || write_index();
}

bool ChunkFile::write_index() {
  put(index_.data(), last_index_offset_);
  const std::uint64_t offset = end_;
  if (!write_chunk({.type = ChunkType::index, .raw_bytes = index_.size()}, index_)) return false;
  last_index_offset_ = offset;
  index_.resize(8);
  return true;
}

bool ChunkFile::sync() {
  if (fdatasync(descriptor_) == 0 || errno == EINVAL) return true;  // EINVAL: not a file that could be synchronised
  return fail(errno);
}

bool ChunkFile::finish(const std::array<EndCounts::OfStream, 2>& streams) {
  const std::uint64_t whole_bytes = end_;
  EndCounts counts;
  counts.streams = streams;
  bool is_written = index_.size() == 8 || write_index();
  counts.last_index_offset = last_index_offset_;
  counts.chunks_count = chunks_count_;
  const auto payload = encode(counts);
  is_written = is_written && write_chunk({.type = ChunkType::end, .raw_bytes = payload.size()}, payload);
  if (!is_written) {
    end_ = whole_bytes;
    (void)!ftruncate(descriptor_, static_cast<off_t>(end_));
  }
  return sync() && is_written;
}

}  // namespace tactus::hal::record

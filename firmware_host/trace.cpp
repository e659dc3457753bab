#include "firmware_host/trace.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "firmware_host/output_file.hpp"

namespace tactus::firmware {
namespace {

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Integer arithmetic: a double would lose the nanoseconds of long sessions.
std::string microseconds(std::int64_t ns) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%" PRId64 ".%03" PRId64, ns / 1000, ns % 1000);
  return text.data();
}

}  // namespace

rt::Result<void> write_trace(const std::filesystem::path& path, std::span<const TraceRecord> records,
                             std::span<const std::string> thread_names) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  std::int64_t origin_ns = records.empty() ? 0 : records[0].start_ns;
  for (const TraceRecord& record : records) origin_ns = std::min(origin_ns, record.start_ns);

  file->write("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  file->write(R"({"ph":"M","pid":1,"tid":1,"name":"process_name","args":{"name":"tactus"}})");
  for (std::size_t t = 0; t < thread_names.size(); ++t) {
    file->print(",\n{\"ph\":\"M\",\"pid\":1,\"tid\":%zu,\"name\":\"thread_name\",\"args\":{\"name\":%s}}",
                t + 1, quoted(thread_names[t]).c_str());
    file->print(
        ",\n{\"ph\":\"M\",\"pid\":1,\"tid\":%zu,\"name\":\"thread_sort_index\",\"args\":{\"sort_index\":%zu}"
        "}",
        t + 1, t + 1);
  }
  for (const TraceRecord& record : records) {
    const std::string name = quoted(record.name), start = microseconds(record.start_ns - origin_ns);
    const std::uint32_t thread = record.thread + 1;
    switch (record.kind) {
      case TraceRecord::Kind::span:
        file->print(
            ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":%u,\"ts\":%s,\"dur\":%s,\"name\":%s,\"args\":{\"frame\":"
            "%" PRIu64 "}}",
            thread, start.c_str(), microseconds(std::max<std::int64_t>(record.duration_ns, 0)).c_str(),
            name.c_str(), record.frame);
        break;
      case TraceRecord::Kind::counter:
        if (!std::isfinite(record.value)) break;  // JSON has no word for it
        file->print(",\n{\"ph\":\"C\",\"pid\":1,\"tid\":%u,\"ts\":%s,\"name\":%s,\"args\":{\"value\":%.9g}}",
                    thread, start.c_str(), name.c_str(), record.value);
        break;
      case TraceRecord::Kind::instant:
        file->print(
            ",\n{\"ph\":\"i\",\"s\":\"t\",\"pid\":1,\"tid\":%u,\"ts\":%s,\"name\":%s,\"args\":{\"frame\":"
            "%" PRIu64 "}}",
            thread, start.c_str(), name.c_str(), record.frame);
        break;
    }
  }
  file->write("\n]}\n");
  return file->close();
}

}  // namespace tactus::firmware

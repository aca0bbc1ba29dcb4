#include "cli/import/byte_source.h"

#include <fmt/format.h>
#include <lzma.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace airworthy::importer {
namespace {

namespace fs = std::filesystem;

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

class PlainSource final : public ByteSource {
 public:
  PlainSource(File file, fs::path path, std::uint64_t size)
      : file_{std::move(file)}, path_{std::move(path)}, size_{size} {}

  rt::Expected<std::size_t> read(std::span<char> buffer) override {
    const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file_.get());
    if (std::ferror(file_.get()) != 0) {
      return rt::fail_with(fmt::format("{}: byte {}: {}", path_.string(), position_, std::strerror(errno)));
    }
    position_ += count;
    return count;
  }
  std::uint64_t position() const override { return position_; }
  std::uint64_t size() const override { return size_; }

 private:
  File file_;
  fs::path path_;
  std::uint64_t size_;
  std::uint64_t position_ = 0;
};

class XzSource final : public ByteSource {
 public:
  // What the strongest preset needs is 65 MiB; a file that asks for more is not one of ours.
  static constexpr std::uint64_t kMostMemory = 256ULL * 1024 * 1024;

  XzSource(std::unique_ptr<ByteSource> file, fs::path path) : file_{std::move(file)}, path_{std::move(path)} {
    // Cannot fail but for lack of memory, which the first read reports.
    started_ = lzma_stream_decoder(&stream_, kMostMemory, LZMA_CONCATENATED);
  }
  XzSource(const XzSource&) = delete;
  XzSource& operator=(const XzSource&) = delete;
  ~XzSource() override { lzma_end(&stream_); }

  rt::Expected<std::size_t> read(std::span<char> buffer) override {
    if (started_ != LZMA_OK) return rt::fail_with(path_.string() + ": no memory to decompress");
    if (ended_ || buffer.empty()) return std::size_t{0};
    stream_.next_out = reinterpret_cast<std::uint8_t*>(buffer.data());
    stream_.avail_out = buffer.size();
    while (stream_.avail_out != 0) {
      if (stream_.avail_in == 0 && !input_ended_) {
        auto count = file_->read(input_);
        if (!count) return count;
        input_ended_ = *count == 0;
        stream_.next_in = reinterpret_cast<const std::uint8_t*>(input_.data());
        stream_.avail_in = *count;
      }
      const lzma_ret result = lzma_code(&stream_, input_ended_ ? LZMA_FINISH : LZMA_RUN);
      if (result == LZMA_STREAM_END) {
        ended_ = true;
        break;
      }
      if (result != LZMA_OK) return failed(result);
    }
    return buffer.size() - stream_.avail_out;
  }
  std::uint64_t position() const override { return stream_.total_in; }
  std::uint64_t size() const override { return file_->size(); }

 private:
  tl::unexpected<rt::Error> failed(lzma_ret result) const {
    // Only the first bytes can be no xz file at all.
    if (result == LZMA_FORMAT_ERROR) return rt::fail_with(path_.string() + ": byte 0: not xz data");
    const char* what = "corrupt xz data";
    if (result == LZMA_BUF_ERROR) what = "truncated xz data";
    if (result == LZMA_MEM_ERROR || result == LZMA_MEMLIMIT_ERROR)
      what = "too much memory needed to decompress";
    if (result == LZMA_OPTIONS_ERROR) what = "xz data of a kind this program does not read";
    return rt::fail_with(fmt::format("{}: byte {}: {}", path_.string(), stream_.total_in, what));
  }

  std::unique_ptr<ByteSource> file_;
  fs::path path_;
  lzma_stream stream_ = LZMA_STREAM_INIT;
  lzma_ret started_ = LZMA_OK;
  std::array<char, 65536> input_{};
  bool input_ended_ = false;
  bool ended_ = false;
};

}  // namespace

rt::Expected<std::unique_ptr<ByteSource>> ByteSource::open(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return rt::fail_with(path.string() + ": a folder, not a file");
  errno = 0;
  File file{std::fopen(path.c_str(), "rb")};
  if (!file) return rt::fail_with(fmt::format("{}: {}", path.string(), std::strerror(errno)));
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return rt::fail_with(fmt::format("{}: {}", path.string(), error.message()));
  if (size == 0) return rt::fail_with(path.string() + ": the file is empty");
  std::unique_ptr<ByteSource> plain = std::make_unique<PlainSource>(std::move(file), path, size);
  if (path.extension() != ".xz") return plain;
  return std::make_unique<XzSource>(std::move(plain), path);
}

rt::Expected<std::string> read_all(const fs::path& path) {
  const auto source = ByteSource::open(path);
  if (!source) return tl::unexpected<rt::Error>{source.error()};
  std::string content;
  std::array<char, 65536> buffer{};
  for (;;) {
    const auto count = (*source)->read(buffer);
    if (!count) return tl::unexpected<rt::Error>{count.error()};
    if (*count == 0) return content;
    content.append(buffer.data(), *count);
  }
}

}  // namespace airworthy::importer

#include "runtime/config/config_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "runtime/config/state.h"

namespace airworthy::rt {
namespace {

Expected<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{std::fopen(path.c_str(), "rb"), &std::fclose};
  const auto system_error = [] { return std::generic_category().message(errno); };
  if (!file) return fail_with("cannot be opened: " + system_error());
  std::string text(max_bytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file.get()));
  if (std::ferror(file.get()) != 0) return fail_with("cannot be read: " + system_error());
  if (text.size() > max_bytes) {
    return fail_with(fmt::format("is larger than {} bytes, no configuration is", max_bytes));
  }
  return text;
}

}  // namespace

ConfigFile::ConfigFile(std::unique_ptr<config_detail::State> state) : state_{std::move(state)} {}
ConfigFile::ConfigFile(ConfigFile&& other) noexcept = default;
ConfigFile& ConfigFile::operator=(ConfigFile&& other) noexcept = default;
ConfigFile::~ConfigFile() = default;

ConfigFile ConfigFile::load(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  auto state = std::make_unique<config_detail::State>(path);
  if (const auto text = read_file(path, kMaxBytes)) {
    state->parse(*text, overrides);
  } else {
    state->fail_whole(text.error().text);
  }
  return ConfigFile{std::move(state)};
}

ConfigFile ConfigFile::parse(std::string_view text, const std::filesystem::path& name,
                             const std::vector<std::string>& overrides) {
  auto state = std::make_unique<config_detail::State>(name);
  state->parse(text, overrides);
  return ConfigFile{std::move(state)};
}

ConfigTable ConfigFile::root() { return ConfigTable{*state_, &state_->root(), "", !state_->readable()}; }

std::string ConfigFile::hash() const { return state_->hash(); }

std::optional<Error> ConfigFile::errors() { return state_->errors(); }

}  // namespace airworthy::rt

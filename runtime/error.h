#pragma once

#include <string>
#include <tl/expected.hpp>

namespace airworthy::rt {

/// Something outside the program that went wrong, in words for the person who must mend it: what, where, why.
struct Error {
  std::string text;
};

template <class T>
using Expected = tl::expected<T, Error>;

inline tl::unexpected<Error> fail_with(std::string text) {
  return tl::unexpected<Error>{Error{std::move(text)}};
}

}  // namespace airworthy::rt

#pragma once

namespace airworthy {

inline constexpr double kGravity_m_s2 = 9.81;

}  // namespace airworthy

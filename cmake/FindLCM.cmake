# Finds Lightweight Communications and Marshalling. Debian's package ships no CMake config, and its pkg-config
# file requires GLib's development package, so library, headers and generator are searched for directly.
#
# Defines lcm::lcm (the library), LCM_GEN (the generator), LCM_LOGGER and LCM_LOGPLAYER (where installed).

find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp)
find_library(LCM_LIBRARY lcm)
find_program(LCM_GEN lcm-gen)
find_program(LCM_LOGGER lcm-logger)
find_program(LCM_LOGPLAYER lcm-logplayer)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN)

if(LCM_FOUND AND NOT TARGET lcm::lcm)
  add_library(lcm::lcm UNKNOWN IMPORTED)
  set_target_properties(lcm::lcm PROPERTIES
    IMPORTED_LOCATION ${LCM_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})
endif()
mark_as_advanced(LCM_INCLUDE_DIR LCM_LIBRARY LCM_GEN LCM_LOGGER LCM_LOGPLAYER)

# Finds libsystemd, for sd_notify. Optional: without it the programs do not report readiness to a service manager.
# Defines systemd::systemd.

find_path(SYSTEMD_INCLUDE_DIR systemd/sd-daemon.h)
find_library(SYSTEMD_LIBRARY systemd)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Systemd REQUIRED_VARS SYSTEMD_LIBRARY SYSTEMD_INCLUDE_DIR)

if(Systemd_FOUND AND NOT TARGET systemd::systemd)
  add_library(systemd::systemd UNKNOWN IMPORTED)
  set_target_properties(systemd::systemd PROPERTIES
    IMPORTED_LOCATION ${SYSTEMD_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${SYSTEMD_INCLUDE_DIR}
    INTERFACE_COMPILE_DEFINITIONS AIRWORTHY_HAVE_SYSTEMD=1)
endif()
mark_as_advanced(SYSTEMD_INCLUDE_DIR SYSTEMD_LIBRARY)

# How every target of the project is compiled: warnings, sanitizers, reproducible floating point.

add_library(airworthy_compile_options INTERFACE)
target_compile_options(airworthy_compile_options INTERFACE
  -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wnon-virtual-dtor
  -Wold-style-cast -Wcast-qual -Werror
  # The same verdict on x86, arm64 and Cortex-M4: no fused multiply-add behind our back.
  -ffp-contract=off)
if(AIRWORTHY_SANITIZE)
  target_compile_options(airworthy_compile_options INTERFACE
    -fsanitize=${AIRWORTHY_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer
    # Core has no run-time type information, which the check of virtual calls needs.
    -fno-sanitize=vptr)
  target_link_options(airworthy_compile_options INTERFACE -fsanitize=${AIRWORTHY_SANITIZE})
endif()
if(AIRWORTHY_FUZZ)
  target_compile_options(airworthy_compile_options INTERFACE
    -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -fno-sanitize=vptr)
  target_link_options(airworthy_compile_options INTERFACE -fsanitize=address,undefined)
endif()

# airworthy_library(<folder> [PURE] SOURCES ... [LINK ...]): a static library with the alias airworthy::<folder>.
# PURE marks core code: no exceptions, no RTTI, so that it stays fit for a microcontroller.
function(airworthy_library name)
  cmake_parse_arguments(ARG "PURE" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(airworthy_${name} STATIC ${ARG_SOURCES})
  add_library(airworthy::${name} ALIAS airworthy_${name})
  target_include_directories(airworthy_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(airworthy_${name} PUBLIC ${ARG_LINK} PRIVATE airworthy_compile_options ${ARG_PRIVATE_LINK})
  if(ARG_PURE)
    target_compile_options(airworthy_${name} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions -fno-rtti>)
  endif()
endfunction()

# airworthy_program(<name> SOURCES ... LINK ...): an executable that is installed.
function(airworthy_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE airworthy_compile_options ${ARG_LINK})
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()

# airworthy_test(<name> SOURCES ... LINK ... [LABELS ...]): a GoogleTest program known to ctest.
function(airworthy_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE airworthy_compile_options ${ARG_LINK} GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 900)  # with sanitizers the longest takes minutes
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "unit;${ARG_LABELS}")
endfunction()

# One target per module, and one test program per module.

# panonav_module(NAME [SOURCES ...] [DEPENDS modules of ours ...] [LINK public libraries ...]
#                [LINK_PRIVATE libraries that no public header shows ...])
# Makes the static library panonav_NAME with the alias panonav::NAME. Headers lie beside the
# sources and are included as "panonav/NAME/x.hpp".
function(panonav_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;LINK;LINK_PRIVATE" ${ARGN})
  set(target panonav_${name})
  add_library(${target} STATIC ${ARG_SOURCES})
  add_library(panonav::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  list(TRANSFORM ARG_DEPENDS PREPEND panonav::)
  target_link_libraries(${target} PUBLIC ${ARG_DEPENDS} ${ARG_LINK} PRIVATE ${ARG_LINK_PRIVATE})
  panonav_warnings(${target})
  install(TARGETS ${target} EXPORT panonavTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/panonav/${name}
          FILES_MATCHING PATTERN "*.hpp")
  set_property(GLOBAL APPEND PROPERTY PANONAV_MODULE_TARGETS ${target})
endfunction()

function(panonav_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion -Wnon-virtual-dtor
                                           # Options are set by name; what is not named has its default.
                                           -Wno-missing-field-initializers)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # gcc 12 warns of overlaps in std::string operations where there are none (its bug 105651).
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(PANONAV_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# panonav_module_tests(NAME [LINK ...]): tests/NAME/*_test.cpp make one program, test_NAME.
function(panonav_module_tests name)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  if(NOT TARGET panonav_${name})
    return()
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(test_${name} PRIVATE panonav::${name} ${ARG_LINK} GTest::gtest_main)
  panonav_warnings(test_${name})
  gtest_discover_tests(test_${name} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST
                       PROPERTIES LABELS unit)
endfunction()

# The target panonav::panonav links every module that was built.
function(panonav_umbrella)
  get_property(targets GLOBAL PROPERTY PANONAV_MODULE_TARGETS)
  add_library(panonav INTERFACE)
  add_library(panonav::panonav ALIAS panonav)
  target_link_libraries(panonav INTERFACE ${targets})
  install(TARGETS panonav EXPORT panonavTargets)
endfunction()

# panonav_find(PACKAGE ...): find_package, and remembers it for users of the installed package.
# Sets PACKAGE_FOUND in the caller's scope as find_package does.
macro(panonav_find package)
  find_package(${package} ${ARGN})
  if(${package}_FOUND)
    set_property(GLOBAL APPEND PROPERTY PANONAV_FOUND_PACKAGES ${package})
  endif()
endmacro()

# The CMake package that `find_package(panonav)` finds after an installation.
function(panonav_install_package)
  include(CMakePackageConfigHelpers)
  get_property(PANONAV_FOUND_PACKAGES GLOBAL PROPERTY PANONAV_FOUND_PACKAGES)
  list(REMOVE_DUPLICATES PANONAV_FOUND_PACKAGES)
  string(REPLACE ";" " " PANONAV_FOUND_PACKAGES "${PANONAV_FOUND_PACKAGES}")
  set(destination ${CMAKE_INSTALL_LIBDIR}/cmake/panonav)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/panonavConfig.cmake.in
    ${PROJECT_BINARY_DIR}/panonavConfig.cmake INSTALL_DESTINATION ${destination})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/panonavConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(EXPORT panonavTargets NAMESPACE panonav:: DESTINATION ${destination})
  install(FILES ${PROJECT_BINARY_DIR}/panonavConfig.cmake ${PROJECT_BINARY_DIR}/panonavConfigVersion.cmake
          DESTINATION ${destination})
endfunction()

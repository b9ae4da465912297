# One target per module, and one test program per module.

# Builds all files that `cmake --install` installs, without the tests.
add_custom_target(panonav_installed)

# panonav_module(NAME [APART] [SOURCES ...] [DEPENDS modules of ours ...] [LINK public libraries ...]
#                [LINK_PRIVATE libraries that no public header shows ...] [LATE such that only some programs need ...]
#                [PACKAGES that find those ...])
# Makes the static library panonav_NAME with the alias panonav::NAME of the sources beside the CMake file and in its
# folder `internal`, unless SOURCES names others. Headers are included as "panonav/NAME/x.hpp", those of a component
# (a folder of src) as "panonav_NAME/x.hpp"; those in `internal` are the module's own and are not installed. Each module
# has an export set of its own, so that users of a module need only the packages of that module and of those before it.
# With BUILD_SHARED_LIBS the modules are parts of one libpanonav (panonav_one_library), and panonav::NAME is that library
# with the headers of the module and of those before it. APART: a static library that uses libpanonav, for the command.
function(panonav_module name)
  cmake_parse_arguments(ARG "APART" "" "SOURCES;DEPENDS;LINK;LINK_PRIVATE;LATE;PACKAGES" ${ARGN})
  set(target panonav_${name})
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR}/src OUTPUT_VARIABLE folder)
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS *.cpp internal/*.cpp)
  endif()
  add_library(${target} STATIC ${ARG_SOURCES})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  set(prefix panonav_)
  if(ARG_APART)
    set(prefix panonav::)
  endif()
  list(TRANSFORM ARG_DEPENDS PREPEND ${prefix} OUTPUT_VARIABLE libraries)
  target_link_libraries(${target} PUBLIC ${libraries} ${ARG_LINK} PRIVATE ${ARG_LINK_PRIVATE} ${ARG_LATE})
  foreach(library IN LISTS ARG_LATE)
    if(TARGET ${library})
      get_target_property(library ${library} LOCATION)
    endif()
    file(REAL_PATH ${library} library)
    if(library MATCHES "\\.so")
      set_property(GLOBAL APPEND PROPERTY PANONAV_LATE_${name} ${library})
    endif()
  endforeach()
  panonav_warnings(${target})
  panonav_precompile(${target})
  if(BUILD_SHARED_LIBS AND ARG_APART)
    add_library(panonav::${name} ALIAS ${target})
    return()
  endif()
  if(BUILD_SHARED_LIBS)
    set(user_target panonav_shared_${name})
    add_library(${user_target} INTERFACE)
    target_compile_features(${user_target} INTERFACE cxx_std_20)
    target_include_directories(${user_target} INTERFACE
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
      $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    list(TRANSFORM ARG_DEPENDS PREPEND panonav_shared_ OUTPUT_VARIABLE libraries)
    target_link_libraries(${user_target} INTERFACE panonav_library ${libraries} ${ARG_LINK})
    list(FILTER ARG_SOURCES INCLUDE REGEX TARGET_OBJECTS)
    set_property(GLOBAL APPEND PROPERTY PANONAV_OBJECTS $<TARGET_OBJECTS:${target}> ${ARG_SOURCES})
    set(ARG_PACKAGES "")  # the library knows where its own are
  else()
    set(user_target ${target})
  endif()
  add_library(panonav::${name} ALIAS ${user_target})
  set_target_properties(${user_target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${user_target} EXPORT panonav_${name}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT panonav_${name} NAMESPACE panonav:: FILE panonav-${name}.cmake
          DESTINATION ${PANONAV_PACKAGE_FOLDER} COMPONENT development)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder}
          COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN internal EXCLUDE)
  set_property(GLOBAL APPEND PROPERTY PANONAV_MODULE_NAMES ${name})
  add_dependencies(panonav_installed ${target})
  set_property(GLOBAL PROPERTY PANONAV_DEPENDS_${name} ${ARG_DEPENDS})
  set_property(GLOBAL PROPERTY PANONAV_PACKAGES_${name} ${ARG_PACKAGES})
endfunction()

# panonav_library(NAME DEPENDS targets ...): a library for the command that is not installed. Its headers are included
# as "NAME/x.hpp".
function(panonav_library name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;LINK_PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS *.cpp)
  add_library(panonav_${name} STATIC ${sources})
  add_library(panonav::${name} ALIAS panonav_${name})
  target_compile_features(panonav_${name} PUBLIC cxx_std_20)
  target_include_directories(panonav_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(panonav_${name} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_LINK_PRIVATE})
  panonav_warnings(panonav_${name})
  panonav_precompile(panonav_${name})
endfunction()

# panonav_embed(TARGET NAME NAMESPACE GLOB): the files as string views in NAME.hpp, for this target; a.css is a_css.
function(panonav_embed target name namespace glob)
  file(GLOB files CONFIGURE_DEPENDS ${glob})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  set(header "#pragma once\n#include <string_view>\nnamespace ${namespace} {\n")
  foreach(embedded IN LISTS files)
    get_filename_component(variable ${embedded} NAME)
    string(REPLACE "." "_" variable ${variable})
    file(READ ${embedded} text)
    string(APPEND header "inline constexpr std::string_view ${variable} = R\"embedded(${text})embedded\";\n")
  endforeach()
  string(APPEND header "}  // namespace ${namespace}\n")
  file(CONFIGURE OUTPUT embedded/${name}.hpp CONTENT "@header@" @ONLY)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/embedded)
endfunction()

# panonav_compile_quickly(TARGET): for what takes longer to compile than to run: the command and tests. What they test
# is compiled with all sanitizers and counts its lines; they themselves are not, which halves their compilation.
function(panonav_compile_quickly target)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(CMAKE_CXX_FLAGS_DEBUG MATCHES "--coverage")
    target_compile_options(${target} PRIVATE
      $<$<CONFIG:Debug>:-fno-sanitize=undefined;-fno-profile-arcs;-fno-test-coverage>)
  endif()
endfunction()

# panonav_precompile(TARGET [HEADER ...]): the standard headers that most sources include, and these, are parsed once
# for all targets that name the same ones and are compiled with the same options: libraries, tests.
function(panonav_precompile target)
  if(NOT PANONAV_PRECOMPILE)
    return()
  endif()
  get_target_property(type ${target} TYPE)  # code for executables is not that of libraries
  get_target_property(options ${target} COMPILE_OPTIONS)
  string(MAKE_C_IDENTIFIER "PANONAV_PRECOMPILED_${type}_${options}_${ARGN}" key)
  get_property(owner GLOBAL PROPERTY ${key})
  if(owner)
    target_precompile_headers(${target} REUSE_FROM ${owner})
    return()
  endif()
  set_property(GLOBAL PROPERTY ${key} ${target})
  target_precompile_headers(${target} PRIVATE
    <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <numbers> <optional>
    <random> <ranges> <span> <sstream> <string> <string_view> <unordered_map> <utility> <variant> <vector> ${ARGN})
endfunction()

function(panonav_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion -Wnon-virtual-dtor
                                           # Options are set by name; what is not named has its default.
                                           -Wno-missing-field-initializers)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # gcc 12 warns of overlaps in std::string operations where there are none (its bugs 105651 and 105329).
    target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_UNITY_BUILD)
    # A source that is compiled with others looks like a header, whose types must not use unnamed namespaces, and what
    # is global in one must not forbid local names in another.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage -Wno-shadow -Wshadow=local)
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
  panonav_compile_quickly(test_${name})
  panonav_precompile(test_${name} <gtest/gtest.h>)
  panonav_add_suites(test_${name} PREFIX ${name} LABEL unit SOURCES ${sources})
endfunction()

# panonav_add_suites(PROGRAM PREFIX name LABEL labels ... [COST cost] SOURCES files): one test PREFIX.SUITE for each test suite
# of a test program, so that what a suite shares (a rendered scene, a memory) is made once. Those of a higher cost begin
# first.
function(panonav_add_suites program)
  cmake_parse_arguments(ARG "" "PREFIX;COST" "LABEL;SOURCES" ${ARGN})
  if(NOT ARG_COST)
    set(ARG_COST 0)
  endif()
  set(suites "")
  foreach(source IN LISTS ARG_SOURCES)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
    file(STRINGS ${source} tests REGEX "^TEST(_F|_P)?\\(")
    list(TRANSFORM tests REPLACE "^TEST[_FP]*\\(([A-Za-z0-9_]+),.*" "\\1")
    list(APPEND suites ${tests})
  endforeach()
  list(REMOVE_DUPLICATES suites)
  foreach(suite IN LISTS suites)
    add_test(NAME ${ARG_PREFIX}.${suite} COMMAND ${program} "--gtest_filter=${suite}.*:*/${suite}.*")
    # A suite of which nothing ran, since what it needs is not there, counts as skipped; one that is not in the program
    # is a fault.
    set_tests_properties(${ARG_PREFIX}.${suite} PROPERTIES LABELS "${ARG_LABEL}" COST ${ARG_COST}
      FAIL_REGULAR_EXPRESSION "from 0 test suites ran"
      SKIP_REGULAR_EXPRESSION "PASSED  . 0 tests\\.[\r\n]+(.  SKIPPED[^\r\n]*[\r\n]+)+$")
  endforeach()
endfunction()

# The target panonav::panonav links every module that was built.
function(panonav_umbrella)
  get_property(names GLOBAL PROPERTY PANONAV_MODULE_NAMES)
  if(BUILD_SHARED_LIBS)
    panonav_one_library(${names})
  endif()
  list(TRANSFORM names PREPEND panonav::)
  add_library(panonav INTERFACE)
  add_library(panonav::panonav ALIAS panonav)
  target_link_libraries(panonav INTERFACE ${names})
endfunction()

# panonav_one_library(module ...): libpanonav of all these modules. What it exports stands in exports.map.
function(panonav_one_library)
  set(exports ${PROJECT_SOURCE_DIR}/cmake/exports.map)
  get_property(objects GLOBAL PROPERTY PANONAV_OBJECTS)
  add_library(panonav_library SHARED ${objects})
  list(TRANSFORM ARGN PREPEND panonav_ OUTPUT_VARIABLE modules)
  target_link_libraries(panonav_library PRIVATE ${modules})  # for what these link
  target_link_options(panonav_library PRIVATE -Wl,--version-script=${exports} -Wl,-z,defs -Wl,--as-needed)
  set_target_properties(panonav_library PROPERTIES OUTPUT_NAME panonav EXPORT_NAME library
    VERSION ${PANONAV_ABI}.${PROJECT_VERSION} SOVERSION ${PANONAV_ABI} LINK_DEPENDS ${exports}
    LINKER_LANGUAGE CXX LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
  panonav_load_late(panonav_library ${ARGN})
  add_dependencies(panonav_installed panonav_library)
  install(TARGETS panonav_library EXPORT panonav_library
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
  install(EXPORT panonav_library NAMESPACE panonav:: FILE panonav-library.cmake
          DESTINATION ${PANONAV_PACKAGE_FOLDER} COMPONENT development)
  # pkg-config: paths are relative to where the file lies, so that the whole tree may move.
  file(RELATIVE_PATH PANONAV_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/panonav.pc.in ${PROJECT_BINARY_DIR}/panonav.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/panonav.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT development)
endfunction()

# The CMake package that `find_package(panonav)` finds after an installation.
function(panonav_install_package)
  include(CMakePackageConfigHelpers)
  get_property(names GLOBAL PROPERTY PANONAV_MODULE_NAMES)
  set(PANONAV_MODULE_TABLE "")
  foreach(name IN LISTS names)
    get_property(depends GLOBAL PROPERTY PANONAV_DEPENDS_${name})
    get_property(packages GLOBAL PROPERTY PANONAV_PACKAGES_${name})
    string(APPEND PANONAV_MODULE_TABLE "set(_panonav_depends_${name} ${depends})\n"
           "set(_panonav_packages_${name} ${packages})\n")
  endforeach()
  string(REPLACE ";" " " PANONAV_MODULE_TABLE "${PANONAV_MODULE_TABLE}")
  string(REPLACE ";" " " PANONAV_MODULE_NAMES "${names}")
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/panonavConfig.cmake.in
    ${PROJECT_BINARY_DIR}/panonavConfig.cmake INSTALL_DESTINATION ${PANONAV_PACKAGE_FOLDER})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/panonavConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/panonavConfig.cmake ${PROJECT_BINARY_DIR}/panonavConfigVersion.cmake
          DESTINATION ${PANONAV_PACKAGE_FOLDER} COMPONENT development)
endfunction()

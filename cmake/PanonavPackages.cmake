# The Debian packages that CPack makes: panonav (command), libpanonav0, libpanonav-dev, python3-panonav, panonav-doc.
# tools/make_packages builds them; PANONAV_MAINTAINER is who answers for the packages.
set(PANONAV_MAINTAINER "panonav maintainers <maintainers@panonav.example>" CACHE STRING "Name <address> in the packages")
set(PANONAV_SITE "" CACHE PATH "Folder of the documentation site (tools/make_site), for panonav-doc")

set(library_package libpanonav${PANONAV_ABI})
set(package_of_command panonav)
set(package_of_library ${library_package})
set(package_of_development libpanonav-dev)
set(package_of_python3 python3-panonav)
set(package_of_documents panonav-doc)
set(CPACK_COMPONENTS_ALL command library development documents)
if(TARGET panonav_python)
  list(APPEND CPACK_COMPONENTS_ALL python3)
endif()

# What Debian wants in every package: the licence and what changed.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # of SOURCE_DATE_EPOCH, where it is set
set(texts ${PROJECT_BINARY_DIR}/debian)
file(MAKE_DIRECTORY ${texts})
configure_file(${PROJECT_SOURCE_DIR}/cmake/debian/changelog.in ${texts}/changelog.Debian @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${texts}/changelog COPYONLY)
execute_process(COMMAND gzip -9nfk changelog.Debian changelog WORKING_DIRECTORY ${texts} COMMAND_ERROR_IS_FATAL ANY)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright ${texts}/changelog.Debian.gz ${texts}/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package_of_${component}} COMPONENT ${component})
endforeach()

set(documents ${CMAKE_INSTALL_DATADIR}/doc/panonav-doc)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${documents} COMPONENT documents)
if(PANONAV_SITE)
  install(DIRECTORY ${PANONAV_SITE}/ DESTINATION ${documents}/html COMPONENT documents)
else()
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${documents} COMPONENT documents)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME panonav)
set(CPACK_PACKAGE_VENDOR panonav)
set(CPACK_PACKAGE_CONTACT "${PANONAV_MAINTAINER}")
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
# Dependencies are those of the ELF files; libpanonav itself is named below, since it is being packed only now.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY "=")

# panonav_package(COMPONENT SECTION DEPENDS SUMMARY TEXT)
function(panonav_package component section depends summary text)
  string(TOUPPER ${component} key)
  foreach(setting "PACKAGE_NAME;${package_of_${component}}" "PACKAGE_SECTION;${section}"
                  "PACKAGE_DEPENDS;${depends}" "DESCRIPTION;${summary}\n${text}")
    list(POP_FRONT setting name)
    set(CPACK_DEBIAN_${key}_${name} "${setting}" PARENT_SCOPE)
  endforeach()
endfunction()
set(same_library "${library_package} (= ${PROJECT_VERSION}-1)")
# What is loaded late (panonav_load_late) stands in no ELF file.
foreach(target command library)
  get_property(late_packages GLOBAL PROPERTY PANONAV_LATE_PACKAGES_panonav_${target})
  list(JOIN late_packages ", " late_of_${target})
endforeach()
set(command_needs ${same_library} ${late_of_command})
list(JOIN command_needs ", " command_needs)
set(about "A robot with one omnidirectional camera remembers what places look like,
and knows from that memory alone where it is, which way it faces, and when
it is somewhere that it has never been.")
panonav_package(command science "${command_needs}" "image-based memory for robot navigation (command)" "${about}
.
This package holds the command panonav with its viewer, manual pages and
completion for bash, zsh and fish.")
panonav_package(library libs "${late_of_library}" "image-based memory for robot navigation (library)" "${about}
.
This package holds the shared library.")
panonav_package(development libdevel "${same_library}" "image-based memory for robot navigation (development files)"
"${about}
.
This package holds the headers, the CMake package and the file for pkg-config.")
panonav_package(documents doc "" "image-based memory for robot navigation (documents)" "${about}
.
This package holds the documents and programs to begin with.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/cmake/debian/triggers")
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS "ffmpeg")  # videos and streams, pictures as PNG
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_SHLIBDEPS OFF)
if(TARGET panonav_python)
  math(EXPR next_minor "${PANONAV_PYTHON_MINOR} + 1")
  panonav_package(python3 python
    "${same_library}, python3 (>= 3.${PANONAV_PYTHON_MINOR}), python3 (<< 3.${next_minor}), python3-numpy"
    "image-based memory for robot navigation (Python)" "${about}
.
This package holds the Python package panonav.")
  set(CPACK_DEBIAN_PYTHON3_PACKAGE_RECOMMENDS panonav)
  set(CPACK_DEBIAN_PYTHON3_PACKAGE_CONTROL_EXTRA
      "${PROJECT_SOURCE_DIR}/cmake/debian/postinst;${PROJECT_SOURCE_DIR}/cmake/debian/prerm")
endif()
include(CPack)

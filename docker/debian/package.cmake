# The Debian package: cpack --config build/release/CPackConfig.cmake -B FOLDER, once kilnd and kiln are built.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # tests and benches are no part of it
install(TARGETS kilnd kiln-cli RUNTIME DESTINATION bin)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/kilnd.service DESTINATION lib/systemd/system)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/kilnd.conf DESTINATION /etc/kiln PERMISSIONS OWNER_READ OWNER_WRITE)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION share/doc/kiln RENAME copyright)

set(CPACK_GENERATOR DEB)
file(STRINGS ${PROJECT_SOURCE_DIR}/core/bake/bake.h engine REGEX "kEngineVersion = ")
string(REGEX MATCH "[0-9]+[.][0-9]+[.][0-9]+" CPACK_PACKAGE_VERSION "${engine}")
set(CPACK_PACKAGE_NAME kiln)
set(CPACK_PACKAGE_CONTACT "The Kiln maintainers <maintainers@kiln.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "bakes light: glTF in, precomputed light out")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # what the programs load decides what the package depends on
set(CPACK_DEBIAN_PACKAGE_DEPENDS "passwd, init-system-helpers")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ca-certificates")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    ${CMAKE_CURRENT_LIST_DIR}/conffiles ${CMAKE_CURRENT_LIST_DIR}/postinst ${CMAKE_CURRENT_LIST_DIR}/prerm
    ${CMAKE_CURRENT_LIST_DIR}/postrm)
include(CPack)

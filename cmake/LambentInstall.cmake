# Headers, CMake package (one export a component, so that a missing third party hurts only who asked for it) and
# pkg-config file.
include(CMakePackageConfigHelpers)
set(lambent_package_dir ${CMAKE_INSTALL_DATADIR}/cmake/lambent)

install(TARGETS lambent EXPORT lambent FILE_SET HEADERS)
install(EXPORT lambent DESTINATION ${lambent_package_dir} NAMESPACE lambent:: FILE lambent-core.cmake)
foreach(component IN LISTS lambent_components)
    install(TARGETS lambent_${component} EXPORT lambent_${component})
    install(EXPORT lambent_${component} DESTINATION ${lambent_package_dir} NAMESPACE lambent::
            FILE lambent-${component}.cmake)
endforeach()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/lambentConfig.cmake.in lambentConfig.cmake
    INSTALL_DESTINATION ${lambent_package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(lambentConfigVersion.cmake COMPATIBILITY SameMajorVersion ARCH_INDEPENDENT)
configure_file(${PROJECT_SOURCE_DIR}/cmake/lambent.pc.in lambent.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/lambentConfig.cmake ${PROJECT_BINARY_DIR}/lambentConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/LambentPackages.cmake
        DESTINATION ${lambent_package_dir})
install(FILES ${PROJECT_BINARY_DIR}/lambent.pc DESTINATION ${CMAKE_INSTALL_DATADIR}/pkgconfig)

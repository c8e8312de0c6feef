# The library's targets: lambent::lambent (GLM, threads), lambent::gltf, lambent::exr, lambent::image.
include(GNUInstallDirs)
include(LambentPackages)

add_library(lambent INTERFACE)
add_library(lambent::lambent ALIAS lambent)
target_compile_features(lambent INTERFACE cxx_std_20)
target_include_directories(lambent INTERFACE
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
find_package(glm REQUIRED)
find_package(Threads REQUIRED)
target_link_libraries(lambent INTERFACE glm::glm Threads::Threads)

foreach(component gltf exr image)
    if(TARGET lambent_${component}_package)
        add_library(lambent_${component} INTERFACE)
        add_library(lambent::${component} ALIAS lambent_${component})
        set_target_properties(lambent_${component} PROPERTIES EXPORT_NAME ${component})
        target_link_libraries(lambent_${component} INTERFACE lambent lambent_${component}_package)
    endif()
endforeach()

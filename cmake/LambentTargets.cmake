# The library's targets: lambent::lambent (GLM, threads), lambent::gltf, lambent::exr, lambent::image.
# No compiler flag is on any of them: users bring their own.
include(GNUInstallDirs)
include(LambentPackages)

find_package(glm REQUIRED)
find_package(Threads REQUIRED)
file(GLOB_RECURSE lambent_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/include/lambent/*.hpp)

add_library(lambent INTERFACE)
add_library(lambent::lambent ALIAS lambent)
target_sources(lambent INTERFACE FILE_SET HEADERS
    BASE_DIRS ${PROJECT_SOURCE_DIR}/include FILES ${lambent_headers})
target_compile_features(lambent INTERFACE cxx_std_20)
target_link_libraries(lambent INTERFACE glm::glm Threads::Threads)

set(lambent_components)
foreach(component gltf exr image)
    if(component STREQUAL "image" AND NOT LAMBENT_WITH_OIIO)
        continue()
    endif()
    lambent_find_package(${component})
    if(lambent_${component}_missing)
        message(STATUS "lambent::${component} left out, it needs ${lambent_${component}_missing}")
        continue()
    endif()
    list(APPEND lambent_components ${component})
    add_library(lambent_${component} INTERFACE)
    add_library(lambent::${component} ALIAS lambent_${component})
    set_target_properties(lambent_${component} PROPERTIES EXPORT_NAME ${component})
    target_link_libraries(lambent_${component} INTERFACE lambent lambent::${component}_package)
endforeach()

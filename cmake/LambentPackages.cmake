# Finds the third-party packages and mends what Debian's get wrong. Each that is found becomes an INTERFACE target
# lambent_<component>_package; a missing one leaves its component out.

# tinygltf: Debian calls it TinyGLTF, upstream tinygltf.
find_package(TinyGLTF QUIET)
if(NOT TARGET TinyGLTF::TinyGLTF)
    find_package(tinygltf QUIET)
endif()
foreach(name TinyGLTF::TinyGLTF tinygltf::tinygltf)
    if(TARGET ${name} AND NOT TARGET lambent_gltf_package)
        add_library(lambent_gltf_package INTERFACE)
        target_link_libraries(lambent_gltf_package INTERFACE ${name})
    endif()
endforeach()

find_package(OpenEXR QUIET CONFIG)
if(TARGET OpenEXR::OpenEXR)
    add_library(lambent_exr_package INTERFACE)
    target_link_libraries(lambent_exr_package INTERFACE OpenEXR::OpenEXR)
    if(TARGET Imath::Imath)
        target_link_libraries(lambent_exr_package INTERFACE Imath::Imath)
    endif()
endif()

# OpenImageIO: Debian's CMake package stops when openimageio-tools is absent and lists an include folder that
# does not exist, so we look for the header and the library ourselves.
if(LAMBENT_WITH_OIIO)
    find_path(LAMBENT_OIIO_INCLUDE_DIR OpenImageIO/imageio.h)
    find_library(LAMBENT_OIIO_LIBRARY OpenImageIO)
    find_library(LAMBENT_OIIO_UTIL_LIBRARY OpenImageIO_Util)
    mark_as_advanced(LAMBENT_OIIO_INCLUDE_DIR LAMBENT_OIIO_LIBRARY LAMBENT_OIIO_UTIL_LIBRARY)
    if(LAMBENT_OIIO_INCLUDE_DIR AND LAMBENT_OIIO_LIBRARY AND TARGET Imath::Imath)
        add_library(lambent_image_package INTERFACE)
        target_include_directories(lambent_image_package SYSTEM INTERFACE ${LAMBENT_OIIO_INCLUDE_DIR})
        target_link_libraries(lambent_image_package INTERFACE ${LAMBENT_OIIO_LIBRARY} Imath::Imath)
        if(LAMBENT_OIIO_UTIL_LIBRARY)
            target_link_libraries(lambent_image_package INTERFACE ${LAMBENT_OIIO_UTIL_LIBRARY})
        endif()
    endif()
endif()

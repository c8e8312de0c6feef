# lambent_find_package(<component>): finds the third parties of one component (gltf, exr, image) and mends what
# Debian's packages get wrong. Where all is found there is a target lambent::<component>_package; else
# lambent_<component>_missing says what is not. Used by our own build and by the installed package alike.

function(lambent_package_target component)
    if(NOT TARGET lambent::${component}_package)
        add_library(lambent::${component}_package INTERFACE IMPORTED GLOBAL)
        target_link_libraries(lambent::${component}_package INTERFACE ${ARGN})
    endif()
endfunction()

macro(lambent_find_package component)
    set(lambent_${component}_missing)
    set(lambent_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
    set(CMAKE_MESSAGE_LOG_LEVEL WARNING) # Debian's Imath tells of its Python library, which nobody asked for
    cmake_language(CALL lambent_find_package_${component})
    set(CMAKE_MESSAGE_LOG_LEVEL "${lambent_log_level}")
endmacro()

# Debian calls it TinyGLTF, upstream tinygltf.
macro(lambent_find_package_gltf)
    find_package(TinyGLTF QUIET)
    if(NOT TARGET TinyGLTF::TinyGLTF)
        find_package(tinygltf QUIET)
    endif()
    if(TARGET TinyGLTF::TinyGLTF)
        lambent_package_target(gltf TinyGLTF::TinyGLTF)
    elseif(TARGET tinygltf::tinygltf)
        lambent_package_target(gltf tinygltf::tinygltf)
    else()
        set(lambent_gltf_missing "tinygltf (Debian: libtinygltf-dev)")
    endif()
endmacro()

# OpenEXR's headers include Imath's by names that need Imath's own include folder.
macro(lambent_find_package_exr)
    find_package(Imath QUIET CONFIG)
    find_package(OpenEXR QUIET CONFIG)
    if(TARGET OpenEXR::OpenEXR AND TARGET Imath::Imath)
        lambent_package_target(exr OpenEXR::OpenEXR Imath::Imath)
    else()
        set(lambent_exr_missing "OpenEXR 3 with Imath (Debian: libopenexr-dev)")
    endif()
endmacro()

# Debian's CMake package of OpenImageIO stops when openimageio-tools is absent, and lists an include folder that
# does not exist. So we look for the header and the libraries themselves.
macro(lambent_find_package_image)
    find_package(Imath QUIET CONFIG)
    find_path(LAMBENT_OIIO_INCLUDE_DIR OpenImageIO/imageio.h)
    find_library(LAMBENT_OIIO_LIBRARY OpenImageIO)
    find_library(LAMBENT_OIIO_UTIL_LIBRARY OpenImageIO_Util)
    mark_as_advanced(LAMBENT_OIIO_INCLUDE_DIR LAMBENT_OIIO_LIBRARY LAMBENT_OIIO_UTIL_LIBRARY)
    if(LAMBENT_OIIO_INCLUDE_DIR AND LAMBENT_OIIO_LIBRARY AND LAMBENT_OIIO_UTIL_LIBRARY AND TARGET Imath::Imath)
        lambent_package_target(image ${LAMBENT_OIIO_LIBRARY} ${LAMBENT_OIIO_UTIL_LIBRARY} Imath::Imath)
        target_include_directories(lambent::image_package SYSTEM INTERFACE ${LAMBENT_OIIO_INCLUDE_DIR})
    else()
        set(lambent_image_missing "OpenImageIO with Imath (Debian: libopenimageio-dev)")
    endif()
endmacro()

# lambent_program(NAME SOURCES... [LIBS libs...]): a program of our own, with our warnings and flags.
# None of these flags is on the library's targets: users bring their own.
add_library(lambent_warnings INTERFACE)
target_compile_options(lambent_warnings INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
    -Wno-psabi) # packs wider than a register of the machine are passed in memory, and may be
if(LAMBENT_WERROR)
    target_compile_options(lambent_warnings INTERFACE -Werror)
endif()
add_library(lambent_flags INTERFACE)
target_link_libraries(lambent_flags INTERFACE lambent_warnings)
if(LAMBENT_NATIVE)
    target_compile_options(lambent_flags INTERFACE -march=native)
endif()

function(lambent_program name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBS")
    add_executable(${name} ${arg_SOURCES} ${arg_UNPARSED_ARGUMENTS})
    target_link_libraries(${name} PRIVATE lambent::lambent lambent_flags ${arg_LIBS})
    set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()

# The denoiser that programs and benchmarks share, whichever of them are built.
add_library(lambent_denoiser OBJECT EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/examples/support/denoise_frame.cpp)
target_link_libraries(lambent_denoiser PRIVATE lambent::lambent lambent_flags)
set_target_properties(lambent_denoiser PROPERTIES CXX_EXTENSIONS OFF)

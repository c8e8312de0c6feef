# What users do with the library, as tests: install it, find it, take it in, fetch it, ask pkg-config for it, drop the
# one-file edition into a program. The prefix has spaces in its path, as some have.
set(stage "${CMAKE_CURRENT_BINARY_DIR}/a prefix")
set(options -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} "-DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}")

add_test(NAME consumer.install
         COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${stage})
set_tests_properties(consumer.install PROPERTIES FIXTURES_SETUP lambent_stage)

function(lambent_consumer_test name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "COMPONENTS;OPTIONS")
    string(REPLACE ";" "," components "${arg_COMPONENTS}")
    add_test(NAME consumer.${name}
             COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test ${CMAKE_CURRENT_SOURCE_DIR}/consumer
                     ${CMAKE_CURRENT_BINARY_DIR}/consumer_${name} --build-generator ${CMAKE_GENERATOR}
                     --build-options ${options} -DLAMBENT_COMPONENTS=${components} ${arg_OPTIONS} --test-command consumer)
endfunction()
set(from_tree -DLAMBENT_ROOT=${PROJECT_SOURCE_DIR} -DLAMBENT_WITH_OIIO=${LAMBENT_WITH_OIIO})
lambent_consumer_test(find_package COMPONENTS ${lambent_components}
                      OPTIONS -DLAMBENT_FROM=find_package -DCMAKE_PREFIX_PATH=${stage})
set_tests_properties(consumer.find_package PROPERTIES FIXTURES_REQUIRED lambent_stage)
if(TARGET lambent::exr)
    lambent_consumer_test(exr_alone COMPONENTS exr OPTIONS -DLAMBENT_FROM=find_package -DCMAKE_PREFIX_PATH=${stage})
    set_tests_properties(consumer.exr_alone PROPERTIES FIXTURES_REQUIRED lambent_stage)
endif()
lambent_consumer_test(add_subdirectory COMPONENTS ${lambent_components}
                      OPTIONS -DLAMBENT_FROM=add_subdirectory ${from_tree})
lambent_consumer_test(fetch_content OPTIONS -DLAMBENT_FROM=fetch_content ${from_tree})

find_program(LAMBENT_PKG_CONFIG pkg-config)
mark_as_advanced(LAMBENT_PKG_CONFIG)
if(LAMBENT_PKG_CONFIG)
    add_test(NAME consumer.pkg_config
             COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/consumer/pkg_config.sh ${CMAKE_CXX_COMPILER}
                     ${stage}/${CMAKE_INSTALL_DATADIR}/pkgconfig ${LAMBENT_PKG_CONFIG}
                     ${CMAKE_CURRENT_BINARY_DIR}/consumer_pkg_config)
    set_tests_properties(consumer.pkg_config PROPERTIES FIXTURES_REQUIRED lambent_stage)
endif()

# The one-file edition, and the parts that have to work without exceptions and run-time types.
set(single ${CMAKE_CURRENT_BINARY_DIR}/single)
file(MAKE_DIRECTORY ${single})
add_custom_command(OUTPUT ${single}/lambent_single.hpp
                   COMMAND sh ${PROJECT_SOURCE_DIR}/cmake/single_header.sh >${single}/lambent_single.hpp
                   DEPENDS ${PROJECT_SOURCE_DIR}/cmake/single_header.sh ${lambent_headers})
add_executable(consumer_single consumer/parts.cpp ${single}/lambent_single.hpp)
target_include_directories(consumer_single PRIVATE ${single})
target_compile_definitions(consumer_single PRIVATE CONSUMER_SINGLE)
target_compile_features(consumer_single PRIVATE cxx_std_20)
target_link_libraries(consumer_single PRIVATE glm::glm Threads::Threads lambent_warnings)
add_executable(consumer_no_exceptions consumer/parts.cpp)
target_compile_options(consumer_no_exceptions PRIVATE -fno-exceptions -fno-rtti)
target_link_libraries(consumer_no_exceptions PRIVATE lambent::lambent lambent_warnings)
foreach(name single no_exceptions)
    target_compile_options(consumer_${name} PRIVATE -O0 -g0)
    add_test(NAME consumer.${name} COMMAND consumer_${name})
endforeach()

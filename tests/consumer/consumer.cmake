# Installs the library to a stage, and builds and runs the user's project against it and against the source tree.
string(REPLACE ";" "," components "${lambent_components}")
set(stage ${CMAKE_CURRENT_BINARY_DIR}/stage)
set(options -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} "-DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}"
            -DLAMBENT_COMPONENTS=${components})

add_test(NAME consumer.install
         COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${stage})
set_tests_properties(consumer.install PROPERTIES FIXTURES_SETUP lambent_stage)

function(lambent_consumer_test name)
    add_test(NAME consumer.${name}
             COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test ${CMAKE_CURRENT_SOURCE_DIR}/consumer
                     ${CMAKE_CURRENT_BINARY_DIR}/consumer_${name} --build-generator ${CMAKE_GENERATOR}
                     --build-options ${options} ${ARGN} --test-command consumer)
endfunction()
lambent_consumer_test(find_package -DCMAKE_PREFIX_PATH=${stage})
lambent_consumer_test(add_subdirectory -DLAMBENT_ROOT=${PROJECT_SOURCE_DIR} -DLAMBENT_WITH_OIIO=${LAMBENT_WITH_OIIO})
set_tests_properties(consumer.find_package PROPERTIES FIXTURES_REQUIRED lambent_stage)

find_program(LAMBENT_PKG_CONFIG pkg-config)
mark_as_advanced(LAMBENT_PKG_CONFIG)
if(LAMBENT_PKG_CONFIG)
    add_test(NAME consumer.pkg_config
             COMMAND sh -c "\"$1\" -fsyntax-only $(PKG_CONFIG_PATH=\"$2\" \"$3\" --cflags lambent) \"$4\"" sh
                     ${CMAKE_CXX_COMPILER} ${stage}/${CMAKE_INSTALL_DATADIR}/pkgconfig ${LAMBENT_PKG_CONFIG}
                     ${CMAKE_CURRENT_SOURCE_DIR}/consumer/main.cpp)
    set_tests_properties(consumer.pkg_config PROPERTIES FIXTURES_REQUIRED lambent_stage)
endif()

# Tests that build tests/consumer as a user would: against an installed static library, with the sources as a sub-directory
# (shared library), and against that shared library installed. Python is out of reach in all three.
set(consumer_source "${PROJECT_SOURCE_DIR}/tests/consumer")
set(consumer_build "${PROJECT_BINARY_DIR}/consumer")
set(consumer_options -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
  -DCMAKE_DISABLE_FIND_PACKAGE_Python=ON -DCMAKE_DISABLE_FIND_PACKAGE_Python3=ON -DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON)

# consumer_test(NAME OPTION…): configures, builds and runs the project in a directory of that name.
function(consumer_test name)
  add_test(NAME consumer.${name}
    COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test ${consumer_source} ${consumer_build}/${name} --build-generator Ninja
      --build-options ${consumer_options} ${ARGN} --test-command ${CMAKE_CTEST_COMMAND} --output-on-failure --no-tests=error)
  set_tests_properties(consumer.${name} PROPERTIES PROCESSORS 2)
endfunction()

add_test(NAME consumer.install_static COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${consumer_build}/static)
consumer_test(find_static -DCMAKE_PREFIX_PATH=${consumer_build}/static)
set_tests_properties(consumer.install_static PROPERTIES FIXTURES_SETUP consumer_static)
set_tests_properties(consumer.find_static PROPERTIES FIXTURES_REQUIRED consumer_static)

consumer_test(subdirectory_shared -DSARFOCUS_SOURCE_DIR=${PROJECT_SOURCE_DIR} -DBUILD_SHARED_LIBS=ON -DSARFOCUS_INSTALL=ON
  -DSARFOCUS_WARNINGS_AS_ERRORS=${SARFOCUS_WARNINGS_AS_ERRORS})
add_test(NAME consumer.install_shared COMMAND ${CMAKE_COMMAND} --install ${consumer_build}/subdirectory_shared --prefix ${consumer_build}/shared)
consumer_test(find_shared -DCMAKE_PREFIX_PATH=${consumer_build}/shared)
set_tests_properties(consumer.subdirectory_shared PROPERTIES FIXTURES_SETUP consumer_subdirectory)
set_tests_properties(consumer.install_shared PROPERTIES FIXTURES_REQUIRED consumer_subdirectory FIXTURES_SETUP consumer_shared)
set_tests_properties(consumer.find_shared PROPERTIES FIXTURES_REQUIRED consumer_shared)

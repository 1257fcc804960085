# ygslam_test_suites(TARGET LABEL): one ctest entry, LABEL.Suite, for each suite of a GoogleTest program,
# so that what a suite sets up (a rendered world, a recording) is made once. gtest_discover_tests would
# start a process for each test. Suites whose names begin with "Nightly" get that label as well.
#
# The second half of this file is run after the program was linked and lists its suites.
if(NOT CMAKE_SCRIPT_MODE_FILE)
  set(YGSLAM_TEST_SUITES_FILE ${CMAKE_CURRENT_LIST_FILE})

  function(ygslam_test_suites target label)
    set(entries ${CMAKE_CURRENT_BINARY_DIR}/${target}_suites.cmake)
    add_custom_command(TARGET ${target} POST_BUILD BYPRODUCTS ${entries} VERBATIM
        COMMAND ${CMAKE_COMMAND} -D program=$<TARGET_FILE:${target}> -D label=${label} -D entries=${entries}
                -D folder=${CMAKE_SOURCE_DIR} "-D emulator=${CMAKE_CROSSCOMPILING_EMULATOR}" -P ${YGSLAM_TEST_SUITES_FILE})
    # A program that was not built is one entry that fails.
    set(include_file ${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake)
    file(WRITE ${include_file} "if(EXISTS \"${entries}\")\n  include(\"${entries}\")\nelse()\n"
                               "  add_test(${target}_NOT_BUILT ${target}_NOT_BUILT)\nendif()\n")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include_file})
  endfunction()
  return()
endif()

execute_process(COMMAND ${emulator} ${program} --gtest_list_tests WORKING_DIRECTORY ${folder}
                OUTPUT_VARIABLE listing RESULT_VARIABLE status TIMEOUT 60)
if(NOT status EQUAL 0)
  file(REMOVE ${program} ${entries})
  message(FATAL_ERROR "${program} --gtest_list_tests: ${status}")
endif()
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listing}")
set(text "")
set(command "")
foreach(word ${emulator} ${program})
  string(APPEND command " \"${word}\"")
endforeach()
foreach(suite ${suites})
  string(REGEX REPLACE "[\n.]" "" suite ${suite})
  set(labels ${label})
  if(suite MATCHES "^Nightly")
    string(APPEND labels " nightly")
  endif()
  string(REPLACE " " ";" labels "${labels}")
  # Of a suite all of which was skipped nothing was shown: its entry says so. Where some tests ran,
  # tools/list_skipped.py names the others.
  string(APPEND text "add_test([=[${label}.${suite}]=]${command} [=[--gtest_filter=${suite}.*]=])\n"
         "set_tests_properties([=[${label}.${suite}]=] PROPERTIES WORKING_DIRECTORY \"${folder}\" "
         "TIMEOUT 900 LABELS \"${labels}\" "
         "SKIP_REGULAR_EXPRESSION [=[  PASSED  \\] 0 tests\\.\n.  SKIPPED [^\n]*\n(.  SKIPPED [^\n]*\n)*\$]=])\n")
endforeach()
file(WRITE ${entries} "${text}")

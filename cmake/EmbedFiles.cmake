# ygslam_embed_files(TARGET NAME HEADER files...): the files become part of the library, so that it
# works from anywhere. HEADER declares `std::optional<std::string_view> NAME(std::string_view)`,
# which takes a file's name without its folder.
function(ygslam_embed_files target name header)
  set(blobs "")
  set(table "")
  set(index 0)
  foreach(path ${ARGN})
    get_filename_component(label ${path} NAME)
    string(APPEND blobs "BLOB(${index}, \"${path}\")\n")
    string(APPEND table "    ENTRY(${index}, \"${label}\"),\n")
    math(EXPR index "${index} + 1")
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/embedded_files.cpp.in ${source} @ONLY)
  set_source_files_properties(${source} PROPERTIES OBJECT_DEPENDS "${ARGN}"
                              SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(${target} PRIVATE ${source})
endfunction()

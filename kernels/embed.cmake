# Writes OUTPUT, a C++ file with the text of each kernel file, so that a program needs no kernel folder at run time.
# The pieces stay below the longest string literal that compilers promise; "#line" is added when a program is put
# together, which is where the including file is known.
set(text "#include \"device/embedded_kernels.hpp\"\n\nnamespace clrad {\nconst EmbeddedKernel embedded_kernels[] = {\n")
foreach(kernel IN LISTS KERNELS)
  file(READ ${KERNEL_DIR}/${kernel} body)
  string(APPEND text "{\"${kernel}\",\n")
  string(LENGTH "${body}" length)
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${body}" ${at} 12000 piece)
    string(APPEND text "R\"CLRADKERNEL(${piece})CLRADKERNEL\"\n")
    math(EXPR at "${at} + 12000")
  endwhile()
  string(APPEND text "\"\"},\n")
endforeach()
string(APPEND text "};\nconst unsigned embedded_kernel_count = sizeof(embedded_kernels) / sizeof(embedded_kernels[0]);\n}  // namespace clrad\n")
file(WRITE ${OUTPUT} "${text}")

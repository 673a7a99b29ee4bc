# Writes the units of the two services. In: `from`, this folder; `to`; `prefix`, `bindir`: where the
# programs are installed.
file(READ "${from}/hardening.conf" GROUSER_HARDENING)
foreach(unit grouser-server grouser-jobs)
  configure_file("${from}/${unit}.service.in" "${to}/${unit}.service" @ONLY)
endforeach()

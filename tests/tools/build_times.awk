# What the steps of a build took, from ninja's log: seconds from start to end, summed by kind, then
# the longest steps. As many steps run at once as there are compilers, so on a machine with nothing
# else to do the sum is about the CPU time.
#   awk -f tests/tools/build_times.awk build/release/.ninja_log
$1 !~ /^#/ {
  step = $1 " " $2 " " $5  # one step may make several files
  if (step in seen) next
  seen[step] = 1
  kind = "other"
  if ($4 ~ /cmake_pch/) kind = "precompiled headers"
  else if ($4 ~ /\.pb\.cc\.o$/) kind = "messages and services"
  else if ($4 ~ /^tests\/.*\.o$/) kind = "sources of tests"
  else if ($4 ~ /\/CMakeFiles\/grouser-[^\/]*\.dir\/.*\.o$/) kind = "sources of programs"
  else if ($4 ~ /\.o$/) kind = "sources of libraries"
  else if ($4 ~ /^bin\/|\.a$|\.so/) kind = "links"
  seconds = ($2 - $1) / 1000
  sum[kind] += seconds
  count[kind]++
  total += seconds
  line[seconds + 1e-7 * NR] = sprintf("%7.1f s  %s", seconds, $4)
}
END {
  for (kind in sum) printf "%7.0f s  %4d  %s\n", sum[kind], count[kind], kind
  printf "%7.0f s        all\n\n", total
  for (i = 0; i < 15; i++) {
    longest = -1
    for (s in line) if (s + 0 > longest) longest = s + 0
    if (longest < 0) break
    for (s in line) if (s + 0 == longest) { print line[s]; delete line[s]; break }
  }
}

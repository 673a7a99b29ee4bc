# From the source's table to ours (see the header of cmu_smooth_wheel.csv):
#   awk -f convert.awk smooth_wheel_beta_0_30_60.csv
# Input columns: wheel, beta_deg, slip, rim_speed_mm_s, n, DP_N, DP_sd, side_N,
# side_sd, load_N, load_sd, sinkage_mm, sinkage_sd. Carriage speed 10 mm/s.
BEGIN {
  FS = ","
  v = 0.010
  pi = atan2(0, -1)
  print "slip,attack_angle_deg,load_n,load_sd,f_x_n,f_x_sd,f_y_n,f_y_sd,sinkage_m,sinkage_sd,rim_speed_m_per_s,speed_m_per_s,repeats"
}
$1 == "smooth" {
  rim = $4 / 1000
  speed = rim > v ? rim : v
  slip = (rim - v * cos($2 * pi / 180)) / speed
  if (slip > -0.0005 && slip < 0.0005) slip = 0  # no "-0.000"
  printf "%.4f,%g,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.5f,%.5f,%.3f,%.3f,%d\n", slip, $2,
         $10, $11, $6, $7, $8, $9, $12 / 1000, $13 / 1000, rim, speed, $5
}

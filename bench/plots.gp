# SPDX-License-Identifier: GPL-2.0-or-later
# The curves of docs/servos.md and docs/loops.md, from bench-plots:
#   gnuplot -e "plots='build/bench/bench-plots'; docs='docs'" bench/plots.gp
set terminal svg size 760,560 font "sans-serif,13" background rgb "#ffffff"
set style line 1 lc rgb "#1f4e79" lw 1.8
set style line 2 lc rgb "#c55a11" lw 1.8
set style line 3 lc rgb "#548235" lw 1.8
set style line 9 lc rgb "#bfbfbf" lw 1.2 dt 2
set grid ytics lc rgb "#e0e0e0" lt 1
set border 3 lc rgb "#595959"
set tics nomirror textcolor rgb "#333333"
set lmargin 10
set rmargin 4

set output docs."/servo-tuning.svg"
servo = "< ".plots." servo"
set multiplot layout 3,1
set xrange [0:0.7]
set key top right
set ylabel "speed, mm/s"
set yrange [0:120]
set format x ""
set bmargin 0.5
plot servo index 0 every 10 using 1:2 with lines ls 9 lw 1.8 title "commanded speed"
set ylabel "error, mm"
set yrange [-0.1:0.55]
set key top right horizontal
plot servo index 0 every 2 using 1:3 with lines ls 1 title "pid-p", \
     "" index 1 every 2 using 1:3 with lines ls 2 title "pid-p, pid-d"
set yrange [-0.06:0.16]
set format x "%g"
set xlabel "seconds; from 0.45 s on, something pulls at the shaft"
set bmargin 3.5
plot servo index 2 every 2 using 1:3 with lines ls 1 title "and velocity-gain", \
     "" index 3 every 2 using 1:3 with lines ls 2 title "and acceleration-gain", \
     "" index 4 every 2 using 1:3 with lines ls 3 title "and pid-i"
unset multiplot

set output docs."/heater-tuning.svg"
heater = "< ".plots." heater"
set terminal svg size 760,420 font "sans-serif,13" background rgb "#ffffff"
set xrange [0:900]
set yrange [20:72]
set key bottom right vertical
set xlabel "seconds; from 600 s on, a fan blows at it"
set ylabel "temperature, °C"
set bmargin 3.5
plot 60 with lines ls 9 title "target", \
     heater index 2 every 3 using 1:2 with lines ls 1 title "an eighth of the gains that were found", \
     "" index 1 every 3 using 1:2 with lines ls 2 title "a quarter of pid-p, twice pid-i, no pid-d", \
     "" index 0 every 3 using 1:2 with lines ls 3 title "gains that were found"
set output

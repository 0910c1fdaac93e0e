// A box with a lid. Try -D 'width=80', -p data/box.json -P tall, --animate 8.
width = 60;   // [20:100]
depth = 40;   // [20:100]
height = 25;  // [10:100]
wall = 2;
label = "box";

module shell() {
  difference() {
    cube([width, depth, height]);
    translate([wall, wall, wall]) cube([width - 2 * wall, depth - 2 * wall, height]);
    // The label is cut into the front.
    translate([width / 2, 1, height / 2]) rotate([90, 0, 0])
      linear_extrude(2) text(label, size = height / 2, halign = "center", valign = "center");
  }
}

module lid() {
  color("Gold") cube([width, depth, wall]);
}

shell();
// The lid opens while an animation runs: $t goes from 0 to 1.
translate([0, depth, height]) rotate([-100 * $t, 0, 0]) translate([0, -depth, 0]) lid();

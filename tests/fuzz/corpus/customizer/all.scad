/* [Size] */
// how wide
width = 20; // [5:0.5:50]
side = 1; // [1:left, 2:"right"]
name = "a\"b"; // 12
hole = [1, -2.5]; // [0:9]
lid = true;
/* [Hidden] */
eps = 0.01;
module m() { x = 1; }

// Writes no colour: the stencil is all that counts.
void main() {}

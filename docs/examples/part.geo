// Two unit cubes on each other. Each has a mesh of its own: nothing joins their faces.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Box(2) = {0, 0, 1, 1, 1, 1};
Transfinite Curve {1:12} = 5; // nodes on each edge
Transfinite Curve {13:24} = 4;

// The names that the case uses: bodies, and what is held, loaded and in contact.
Physical Volume("lower") = {1};
Physical Volume("upper") = {2};
Physical Surface("floor") = {5};
Physical Surface("lower_face") = {6};
Physical Surface("upper_face") = {11};
Physical Surface("lid") = {12};

//! Free-form deformation by B-spline lattices in two and three dimensions.

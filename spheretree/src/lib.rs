//! Octree sphere trees: which part of a deforming surface does a hand touch?.

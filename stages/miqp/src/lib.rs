//! Fewest grasps: mixed-integer quadratic programme.

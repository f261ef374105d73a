"""A cloth in real time: pacing, overload, error estimate, kernel compilation.  No ROS."""

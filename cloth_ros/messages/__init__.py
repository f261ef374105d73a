"""Serialise array data as ROS messages without one Python object per point."""

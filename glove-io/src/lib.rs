//! CyberGlove and FASTRAK: parsers, encoders, simulators, calibration and hand kinematics.

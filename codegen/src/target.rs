//! Cross toolchain, emulator and image analysis.

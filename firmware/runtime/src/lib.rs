#![no_std]
//! Control kernels that every emitted controller uses.

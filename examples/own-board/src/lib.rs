//! A machine on a board of one's own: seven AD7685 and a DAC80508 on an STM32H743. The page is docs/porting.md.
#![cfg_attr(not(test), no_std)]
#![deny(missing_docs)]

pub mod ad7685;
pub mod dac80508;
#[cfg(target_os = "none")]
pub mod machine;
#[cfg(test)]
mod tests;

//! The memory protection unit of an M7: regions by RNR, RBAR, RASR. Nothing is refused by it here; what it would let pass is asked.

/// RNR to RASR, and the RAR of 16 numbers.
pub const REGISTERS: std::ops::RangeInclusive<u32> = 0xe000_ed94..=0xe000_eda0;

#[derive(Default)]
pub struct Mpu {
    control: u32,
    number: usize,
    /// RBAR and RASR.
    regions: [[u32; 2]; 16],
}

/// What may be done at an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    None,
    Read,
    Full,
}

impl Mpu {
    pub fn read(&self, address: u32) -> u32 {
        match address & 0xf {
            4 => self.control,
            8 => self.number as u32,
            0xc => self.regions[self.number][0],
            _ => self.regions[self.number][1],
        }
    }

    pub fn write(&mut self, address: u32, value: u32) {
        match address & 0xf {
            4 => self.control = value,
            8 => self.number = value as usize & 15,
            0xc => {
                if value >> 4 & 1 == 1 {
                    self.number = value as usize & 15;
                }
                self.regions[self.number][0] = value & !0x1f;
            }
            _ => self.regions[self.number][1] = value,
        }
    }

    /// By the highest region that has the address, else by the default map, which lets everything pass.
    pub fn access(&self, address: u32) -> Access {
        if self.control & 1 == 0 {
            return Access::Full;
        }
        let rights = self.regions.iter().rev().find_map(|[base, rights]| {
            let bits = (rights >> 1 & 0x1f) + 1;
            let offset = u64::from(address.wrapping_sub(*base));
            let eighth = (offset << 3 >> bits) as u32;
            (rights & 1 == 1 && offset >> bits == 0 && rights >> (8 + eighth) & 1 == 0).then_some(rights >> 24 & 7)
        });
        match rights {
            None if self.control & 4 == 0 => Access::None,
            None | Some(1..=3) => Access::Full,
            Some(5 | 6) => Access::Read,
            Some(_) => Access::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_region_counts_and_eighths_can_be_left_out() {
        let mut mpu = Mpu::default();
        assert_eq!(mpu.access(0x6000_0000), Access::Full);
        for (base, rights) in [(0x10, 0x84 << 8 | 31 << 1 | 1), (0x0800_0011, 6 << 24 | 20 << 1 | 1)] {
            mpu.write(0xe000_ed9c, base);
            mpu.write(0xe000_eda0, rights);
        }
        mpu.write(0xe000_ed94, 5);
        let at = |address| mpu.access(address);
        assert_eq!([0x0800_0000, 0x081f_ffff].map(at), [Access::Read; 2]);
        assert_eq!([0x0820_0000, 0x2000_0000, 0x6000_0000, 0xdfff_ffff].map(at), [Access::None; 4]);
        assert_eq!([0x4000_0000, 0x5fff_ffff, 0xe000_0000].map(at), [Access::Full; 3]);
        mpu.write(0xe000_ed94, 1);
        assert_eq!(mpu.access(0x4000_0000), Access::None);
    }
}

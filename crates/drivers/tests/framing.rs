//! Bytes on SPI and I2C, compared with the parts' data sheets.

use afbc_drivers::bmp3::Bmp388;
use afbc_drivers::dps310::Dps310;
use afbc_drivers::lis3mdl::Lis3mdl;
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::{I2cRegisters, Registers, SensorPart, SpiRegisters};
use embassy_futures::block_on;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use std::convert::Infallible;

/// For each transaction, the bytes written and the number of bytes read after them. Reads return 1, 2, 3.
#[derive(Default)]
struct Wires(Vec<(Vec<u8>, usize)>);

impl Wires {
    fn fill(&mut self, into: &mut [u8]) {
        into.iter_mut().zip(1..).for_each(|(byte, number)| *byte = number);
        self.0.last_mut().expect("written before").1 += into.len();
    }
}

impl spi::ErrorType for &mut Wires {
    type Error = Infallible;
}

impl SpiDevice for &mut Wires {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Infallible> {
        self.0.push((Vec::new(), 0));
        for operation in operations {
            match operation {
                spi::Operation::Write(bytes) => self.0.last_mut().expect("pushed").0.extend(&**bytes),
                // The last two bytes are the answer.
                spi::Operation::TransferInPlace(bytes) => {
                    let (head, answer) = bytes.split_at_mut(bytes.len() - 2);
                    self.0.last_mut().expect("pushed").0.extend(&*head);
                    self.fill(answer);
                }
                _ => panic!("{operation:?}"),
            }
        }
        Ok(())
    }
}

impl i2c::ErrorType for &mut Wires {
    type Error = Infallible;
}

impl I2c for &mut Wires {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), Infallible> {
        self.0.push((vec![address], 0));
        for operation in operations {
            match operation {
                i2c::Operation::Write(bytes) => self.0.last_mut().expect("pushed").0.extend(&**bytes),
                i2c::Operation::Read(into) => self.fill(into),
            }
        }
        Ok(())
    }
}

/// Reads two bytes from a register, writes the register and sends a command.
fn crossing(mut registers: impl Registers, register: u8) {
    let mut answer = [0; 2];
    block_on(registers.read(register, &mut answer)).expect("no errors");
    assert_eq!(answer, [1, 2]);
    block_on(registers.write(register, &[0x55])).expect("no errors");
    block_on(registers.write(register, &[])).expect("no errors");
}

fn on_spi<P: SensorPart>(register: u8) -> Vec<(Vec<u8>, usize)> {
    let mut wires = Wires::default();
    crossing(SpiRegisters::new(&mut wires, P::SPI.expect("on SPI")), register);
    wires.0
}

#[test]
fn spi_is_framed_as_each_part_has_it() {
    let common = vec![(vec![0x80], 2), (vec![0x00, 0x55], 0), (vec![0x00], 0)];
    assert_eq!(on_spi::<Dps310>(0x00), common);
    // BMP3 sends a dummy byte before the answer.
    assert_eq!(on_spi::<Bmp388>(0x04)[0], (vec![0x84, 0], 2));
    assert_eq!(on_spi::<Bmp388>(0x1B)[1], (vec![0x1B, 0x55], 0));
    // MS5611 has commands instead of registers.
    assert_eq!(on_spi::<Ms5611>(0xA2)[0], (vec![0xA2], 2));
    assert_eq!(on_spi::<Ms5611>(0x48)[2], (vec![0x48], 0));
    // The bit for automatic increment of the address differs between SPI and I2C.
    assert_eq!(on_spi::<Lis3mdl>(0x28 | 0x80)[0], (vec![0xE8], 2));
    assert_eq!(on_spi::<Lis3mdl>(0x20)[1], (vec![0x60, 0x55], 0));
}

#[test]
fn i2c_writes_the_register_and_reads() {
    let mut wires = Wires::default();
    crossing(I2cRegisters::new(&mut wires, 0x77), 0x48);
    assert_eq!(wires.0, [(vec![0x77, 0x48], 2), (vec![0x77, 0x48, 0x55], 0), (vec![0x77, 0x48], 0)]);
}

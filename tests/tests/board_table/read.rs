//! Reads a board's table from its code.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::fs;
use std::path::Path;

/// A DMA stream, with its channel type (`DMA1_CH6`) and its interrupt (`DMA1_STREAM6`).
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Stream {
    pub(crate) channel: String,
    pub(crate) line: String,
}

/// A serial port.
#[derive(Debug)]
pub(crate) struct Uart {
    pub(crate) name: String,
    pub(crate) tx: String,
    pub(crate) rx: String,
}

/// UART of the radio receiver, the pad of its inverter, and the pin that switches the inverter.
#[derive(Debug)]
pub(crate) struct Radio {
    pub(crate) uart: Uart,
    pub(crate) pad: String,
    pub(crate) inverter: Option<String>,
}

/// Interrupt pin of a part, its EXTI line (`EXTI5`) and the interrupt of that line (`EXTI9_5`).
#[derive(Debug)]
pub(crate) struct ReadyPin {
    pub(crate) pin: String,
    pub(crate) channel: String,
    pub(crate) line: String,
}

/// SPI bus of the IMU.
#[derive(Debug)]
pub(crate) struct Spi {
    pub(crate) name: String,
    pub(crate) clock: String,
    pub(crate) out: String,
    pub(crate) into: String,
    pub(crate) select: String,
    /// Streams for sending and receiving.
    pub(crate) streams: [Stream; 2],
    pub(crate) ready: ReadyPin,
    pub(crate) parts: Vec<String>,
    pub(crate) alignment: String,
}

/// I2C bus of barometer and compass.
#[derive(Debug)]
pub(crate) struct I2c {
    pub(crate) name: String,
    pub(crate) clock: String,
    pub(crate) data: String,
    /// Event interrupt, error interrupt.
    pub(crate) lines: [String; 2],
    /// Streams for sending and receiving.
    pub(crate) streams: [Stream; 2],
    pub(crate) barometers: Vec<String>,
}

/// Pins that measure the battery, and the scales of their voltages.
#[derive(Debug)]
pub(crate) struct Battery {
    pub(crate) converter: String,
    pub(crate) voltage: String,
    pub(crate) current: String,
    pub(crate) volts_per_volt: f64,
    pub(crate) amperes_per_volt: f64,
}

/// SPI bus of the memory card or flash chip for logs.
#[derive(Debug)]
pub(crate) struct LogBus {
    pub(crate) is_flash: bool,
    pub(crate) name: String,
    pub(crate) clock: String,
    pub(crate) out: String,
    pub(crate) into: String,
    pub(crate) select: String,
    /// Select pins of other parts on the bus.
    pub(crate) quiet: Vec<String>,
}

/// Motor output at a timer channel.
#[derive(Debug)]
pub(crate) struct Motor {
    pub(crate) pin: String,
    pub(crate) port: String,
    pub(crate) bit: String,
    pub(crate) number: usize,
}

/// A timer that drives motors.
#[derive(Debug)]
pub(crate) struct Timer {
    pub(crate) name: String,
    pub(crate) word: String,
    pub(crate) stream: Stream,
    /// Outputs of channels 1 to 4.
    pub(crate) channels: Vec<Option<Motor>>,
}

/// A board that is a table.
#[derive(Debug)]
pub(crate) struct BoardTable {
    pub(crate) crystal_hz: u32,
    pub(crate) link: Uart,
    pub(crate) gnss: Uart,
    pub(crate) radio: Option<Radio>,
    /// UART that receives the ESC telemetry.
    pub(crate) escs: Option<Uart>,
    pub(crate) imu: Spi,
    pub(crate) i2c: I2c,
    pub(crate) battery: Battery,
    pub(crate) led: Option<String>,
    pub(crate) buzzer: String,
    /// Enable pin of the board's Bluetooth module.
    pub(crate) bluetooth: Option<String>,
    pub(crate) logs: Option<LogBus>,
    pub(crate) outputs: usize,
    pub(crate) numbering: String,
    pub(crate) timers: Vec<Timer>,
}

impl BoardTable {
    /// Reads the table in a board's file.
    pub(crate) fn read(board: &Path) -> Self {
        let text = fs::read_to_string(board).unwrap();
        let file = syn::parse_file(&text).unwrap();
        let tokens = file.items.into_iter().find_map(|item| match item {
            syn::Item::Macro(item) if item.mac.path.segments.last().unwrap().ident == "flight_controller" => {
                Some(item.mac.tokens)
            }
            _ => None,
        });
        let tokens = tokens.unwrap_or_else(|| panic!("{}: no table", board.display()));
        let mut words = Words::of(tokens);
        let crystal_hz = words.after("crystal_hz :").parse().unwrap();
        let link = words.uart("link");
        let gnss = words.uart("gnss");
        let radio = (words.peek() == "radio").then(|| words.radio());
        let escs = (words.peek() == "escs").then(|| words.uart("escs"));
        let imu = Spi {
            name: words.after("imu :"),
            clock: words.after("{ clock :"),
            out: words.after("out :"),
            into: words.after("in :"),
            select: words.after("select :"),
            streams: words.streams(),
            ready: ReadyPin { pin: words.after("ready :"), channel: words.after("on"), line: words.after("by") },
            parts: words.parts("parts :"),
            alignment: words.after("alignment :"),
        };
        words.expect("}");
        let i2c = I2c {
            name: words.after("i2c :"),
            clock: words.after("{ clock :"),
            data: words.after("data :"),
            lines: [words.after("interrupts :"), words.after("")],
            streams: words.streams(),
            barometers: words.parts("barometer :"),
        };
        words.expect("}");
        let battery = Battery {
            converter: words.after("battery :"),
            voltage: words.after("{ voltage :"),
            current: words.after("current :"),
            volts_per_volt: words.after("volts_per_volt :").parse().unwrap(),
            amperes_per_volt: words.after("amperes_per_volt :").parse().unwrap(),
        };
        words.expect("}");
        words.expect("indicator");
        words.expect(":");
        words.expect("{");
        let led = (words.peek() == "led").then(|| words.after("led :"));
        let buzzer = words.after("buzzer :");
        words.expect("}");
        let bluetooth = (words.peek() == "bluetooth").then(|| words.after("bluetooth :"));
        let logs = ["card", "flash"].contains(&words.peek()).then(|| {
            let is_flash = words.peek() == "flash";
            let logs = LogBus {
                is_flash,
                name: words.after(if is_flash { "flash :" } else { "card :" }),
                clock: words.after("{ clock :"),
                out: words.after("out :"),
                into: words.after("in :"),
                select: words.after("select :"),
                quiet: if is_flash { Vec::new() } else { words.list("quiet :") },
            };
            words.expect("}");
            logs
        });
        let outputs = words.after("motors :").parse().unwrap();
        let numbering = words.after("as");
        words.expect("{");
        let mut timers = Vec::new();
        while words.peek() != "}" {
            words.after(""); // the task's name
            let (name, word) = (words.after(":"), words.after("<"));
            words.expect(">");
            let stream = words.stream();
            words.expect("{");
            let channels = (0..4).map(|_| words.channel()).collect();
            words.expect("}");
            timers.push(Timer { name, word, stream, channels });
        }
        words.expect("}");
        assert!(words.0.is_empty(), "{}: {:?}", board.display(), words.0);
        BoardTable {
            crystal_hz,
            link,
            gnss,
            radio,
            escs,
            imu,
            i2c,
            battery,
            led,
            buzzer,
            bluetooth,
            logs,
            outputs,
            numbering,
            timers,
        }
    }

    /// Returns the motors.
    pub(crate) fn motors(&self) -> impl Iterator<Item = &Motor> {
        self.timers.iter().flat_map(|timer| timer.channels.iter().flatten())
    }

    /// Returns the DMA streams.
    pub(crate) fn streams(&self) -> Vec<&Stream> {
        let buses = self.imu.streams.iter().chain(&self.i2c.streams);
        buses.chain(self.timers.iter().map(|timer| &timer.stream)).collect()
    }

    /// Returns every used pin, once for each use.
    pub(crate) fn pins(&self) -> Vec<&str> {
        let radio = self.radio.as_ref().map(|radio| &radio.uart);
        let inverter = self.radio.iter().flat_map(|radio| &radio.inverter);
        let uarts =
            [&self.link, &self.gnss].into_iter().chain(radio).chain(&self.escs).flat_map(|uart| [&uart.tx, &uart.rx]);
        let Spi { clock, out, into, select, ready, .. } = &self.imu;
        let buses = [
            clock,
            out,
            into,
            select,
            &ready.pin,
            &self.i2c.clock,
            &self.i2c.data,
            &self.battery.voltage,
            &self.battery.current,
        ];
        let motors = self.motors().map(|motor| &motor.pin);
        let logs = self.logs.iter().flat_map(|LogBus { clock, out, into, select, quiet, .. }| {
            [clock, out, into, select].into_iter().chain(quiet)
        });
        let held = [&self.buzzer].into_iter().chain(&self.led).chain(&self.bluetooth).chain(inverter);
        let all = uarts.chain(buses).chain(motors).chain(logs).chain(held);
        all.map(String::as_str).collect()
    }
}

/// Words of a table without commas, in reverse order.
struct Words(Vec<String>);

impl Words {
    fn of(tokens: TokenStream) -> Self {
        let mut words = flat(tokens);
        words.reverse();
        Words(words)
    }

    fn peek(&self) -> &str {
        self.0.last().unwrap()
    }

    fn expect(&mut self, word: &str) {
        assert_eq!(self.0.pop().as_deref(), Some(word), "before {:?}", self.0.iter().rev().take(8).collect::<Vec<_>>());
    }

    /// Returns the word that follows the words of `key`.
    fn after(&mut self, key: &str) -> String {
        key.split_whitespace().for_each(|word| self.expect(word));
        self.0.pop().unwrap()
    }

    fn uart(&mut self, key: &str) -> Uart {
        let uart = Uart { name: self.after(&format!("{key} :")), tx: self.after("{ tx :"), rx: self.after("rx :") };
        self.expect("}");
        uart
    }

    fn radio(&mut self) -> Radio {
        let uart = Uart { name: self.after("radio :"), tx: self.after("{ tx :"), rx: self.after("rx :") };
        let pad = self.after("sbus :").replace('"', "");
        let inverter = (self.peek() == "inverter").then(|| self.after("inverter :"));
        self.expect("}");
        Radio { uart, pad, inverter }
    }

    fn stream(&mut self) -> Stream {
        Stream { channel: self.after(""), line: self.after("by") }
    }

    fn streams(&mut self) -> [Stream; 2] {
        self.expect("dma");
        self.expect(":");
        [self.stream(), self.stream()]
    }

    /// Returns the words of a tuple, without generic arguments in angle brackets.
    fn parts(&mut self, key: &str) -> Vec<String> {
        let mut parts = Vec::new();
        let mut word = self.after(&format!("{key} ("));
        let mut depth = 0;
        while word != ")" {
            match word.as_str() {
                "<" => depth += 1,
                ">" => depth -= 1,
                _ if depth == 0 => parts.push(word),
                _ => (),
            }
            word = self.after("");
        }
        parts
    }

    /// Returns the words of a list.
    fn list(&mut self, key: &str) -> Vec<String> {
        let mut list = Vec::new();
        let mut word = self.after(&format!("{key} ["));
        while word != "]" {
            list.push(word);
            word = self.after("");
        }
        list
    }

    fn channel(&mut self) -> Option<Motor> {
        self.expect("(");
        let motor = (self.peek() != ")").then(|| Motor {
            pin: self.after(""),
            port: self.after(":"),
            bit: self.after(""),
            number: self.after("motor").parse().unwrap(),
        });
        self.expect(")");
        motor
    }
}

/// Returns the words of a token stream.
fn flat(tokens: TokenStream) -> Vec<String> {
    let words = |token: TokenTree| match token {
        TokenTree::Group(group) => {
            let (open, close) = match group.delimiter() {
                Delimiter::Brace => ("{", "}"),
                Delimiter::Parenthesis => ("(", ")"),
                Delimiter::Bracket | Delimiter::None => ("[", "]"),
            };
            let inside = flat(group.stream());
            [vec![open.to_owned()], inside, vec![close.to_owned()]].concat()
        }
        TokenTree::Punct(punct) if punct.as_char() == ',' => Vec::new(),
        TokenTree::Literal(literal) => vec![literal.to_string().replace('_', "")],
        token => vec![token.to_string()],
    };
    tokens.into_iter().flat_map(words).collect()
}

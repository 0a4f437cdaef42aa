//! Random numbers from a seed.

/// Generator: Marsaglia's xorshift.
#[derive(Clone, Copy, Debug)]
pub struct Xorshift(u64);

impl Xorshift {
    /// Creates a generator from a seed and the name of its use.
    pub fn new(seed: u64, name: &str) -> Self {
        let mix = name
            .bytes()
            .fold(seed ^ 0x9E37_79B9_7F4A_7C15, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
        // A state of zero would stay zero.
        let mut random = Xorshift(mix | 1);
        // The first numbers of similar seeds are alike, and are skipped.
        for _ in 0..16 {
            random.next();
        }
        random
    }

    /// Returns 64 random bits.
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Returns a random number below `end`.
    pub fn below(&mut self, end: u64) -> u64 {
        self.next() % end.max(1)
    }
}

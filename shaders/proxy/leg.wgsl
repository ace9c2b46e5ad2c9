// A stretch of a ray seen from afar, and a collision drawn on it.

struct ProxyLeg {
    depth: f32,   // optical depth of the strongest channel, all of the way
    met: bool,    // whether the wanted depth lies on the way
    t: f32,       // where
    rate: f32,    // extinction there, as the proxy has it
    end: f32,     // beyond this there is nothing
    looks: u32,   // at the density from afar
}

// Stands for an endless optical depth; small enough to be multiplied by 0.
const PROXY_ENDLESS: f32 = 1e6;

// What a pixel makes of its own path and of those of its partners: pairwise MIS with a defensive share of its own (Bitterli 2022;
// Lin et al. 2022). With the aims of both paths at both places known, nothing is evaluated.
//!use core/params
//!use reuse/pair

// A pixel among its partners.
struct Pairwise {
    own: Reservoir,
    others: f32,  // C: confidence of all partners
    total: f32,   // and with its own
    own_m: f32,   // MIS weight of its own path, of the partners met so far
}

// A path that may be shown here.
struct PairwiseOffer {
    path: Path,   // as it is here
    aim: f32,
    w: f32,       // resampling weight: m p̂ W
    age: u32,
}

fn pairwise_begin(position: vec2u, own: Reservoir, frame: Frame) -> Pairwise {
    var others = 0.0;
    for (var round = 0u; round < frame.neighbours; round++) {
        let partner = pair_partner(position, round, frame);
        let q = vec2u(max(partner, vec2i(0)));
        let confidence = bitcast<f32>(reservoir_near[2u * (q.y * params.width + q.x) + 1u].w);
        others += select(0.0, confidence, partner.x >= 0);
    }
    let total = own.confidence + others;
    return Pairwise(own, others, total, own.confidence / total);
}

// What the partner of a round offers.
fn pairwise_meet(all: ptr<function, Pairwise>, position: vec2u, round: u32, frame: Frame) -> PairwiseOffer {
    let own = (*all).own;
    let others = (*all).others;
    let own_part = own.confidence * own.aim;
    let pixels = params.width * params.height;
    let partner = pair_partner(position, round, frame);
    let q = vec2u(max(partner, vec2i(0)));
    let other_pixel = q.y * params.width + q.x;
    let other = reservoir_load(other_pixel);
    let share = select(0.0, other.confidence / (*all).total, partner.x >= 0);
    // Of our path at the partner's place, and of theirs here.
    let there = pair_aims[round * pixels + position.y * params.width + position.x];
    let here = pair_aims[round * pixels + other_pixel];
    (*all).own_m += share * own_part / max(others * there + own_part, 1e-37);
    let part = others * other.aim;
    let m = share * part / max(part + own.confidence * here, 1e-37);
    let offers = partner.x >= 0 && here > 0.0 && other.aim > 0.0;
    var offer = PairwiseOffer();
    if (offers) {
        let path = pair_shift(other.path, q, position, frame.reconnect).path;
        offer = PairwiseOffer(path, here, m * here * other.weight, other.age);
    }
    return offer;
}

// What the pixel's own path offers, after all partners.
fn pairwise_own(all: Pairwise) -> PairwiseOffer {
    let own = all.own;
    return PairwiseOffer(own.path, own.aim, select(0.0, all.own_m * own.aim * own.weight, own.aim > 0.0), own.age);
}

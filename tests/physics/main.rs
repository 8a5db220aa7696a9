//! Closed forms. Each test also shows that it can fail: it rejects an answer off by 2 %.

mod support;
mod volume;

mod agreement;
mod alpha;
mod area_light;
mod atlas;
mod contact;
mod determinism;
mod edges;
mod emission;
mod emissive;
mod environment;
mod extremes;
mod features;
mod fluorescence;
mod furnace;
mod glass;
mod glints;
mod k;
mod ledger;
mod lens;
mod matrices;
mod media;
mod mirrors;
mod moved;
mod nearest;
mod omissions;
mod online_error;
mod pilot;
mod profile;
mod square;
mod textures;

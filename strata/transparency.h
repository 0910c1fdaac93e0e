#pragma once

// Order-independent transparency: one scene, one view, any technique of the field, each with what
// it costs and where it fails.
//
//     auto frame = strata::transparency::Frame::make(scene, view);
//     auto technique = strata::transparency::parse_technique("count-scan");
//     auto rendering = frame->render(*technique->technique, technique->settings);
//
// Solids filled with media, particles, coloured shadows:
//
//     auto settings = strata::transparency::read_media("fog.json");
//     auto picture = strata::transparency::render_media(scene, view, *settings);

#include "strata/raster/view.h"
#include "strata/transparency/media/fxaa.h"
#include "strata/transparency/media/media.h"
#include "strata/transparency/media/shadow_map.h"
#include "strata/transparency/stream/frame.h"
#include "strata/transparency/techniques.h"

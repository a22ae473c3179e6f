#![no_main]
portolan_fuzz::target!("ply", portolan_fuzz::readers::ply);

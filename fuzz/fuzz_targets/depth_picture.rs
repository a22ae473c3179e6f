#![no_main]
portolan_fuzz::target!("depth_picture", portolan_fuzz::readers::depth_picture);

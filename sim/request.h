/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_REQUEST_H
#define SIM_REQUEST_H

/*
 * One handler per operation. It reads the 64-byte request and fills in the
 * 64-byte reply, which it finds zeroed but for the header (0xAA, operation,
 * request id); the checksum is put on afterwards. Requests have been checked:
 * length, header byte and checksum are good.
 */

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "sim/device.h"

enum sim_answer {
	SIM_ANSWER,         /* send the reply */
	SIM_ANSWER_NONE,    /* the operation has no reply (0x4B/0x10) */
	SIM_ANSWER_UNKNOWN, /* this device does not have the operation */
};

typedef enum sim_answer (*sim_handler)(struct sim_device *dev, const uint8_t *rq, uint8_t *rp);

/* Header bytes of a request by the names of the protocol sheet. */
#define P1 2
#define P2 3
#define P3 4
#define P4 5

/* Whether configuration commands are refused (0x51, section 1.12). */
static inline bool sim_locked(const struct sim_device *dev)
{
	return dev->config.identity.locked;
}

#define SIM_HANDLER(name) \
	enum sim_answer name(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)

/* identity.c, misc.c */
SIM_HANDLER(sim_do_device_data);
SIM_HANDLER(sim_do_set_user_id);
SIM_HANDLER(sim_do_user_id);
SIM_HANDLER(sim_do_build_date);
SIM_HANDLER(sim_do_load);
SIM_HANDLER(sim_do_name);
SIM_HANDLER(sim_do_usb);
SIM_HANDLER(sim_do_delayed_start);
SIM_HANDLER(sim_do_session);
SIM_HANDLER(sim_do_misc_usb);
SIM_HANDLER(sim_do_activation);
SIM_HANDLER(sim_do_tick);
/* network.c, security.c, store.c */
SIM_HANDLER(sim_do_network);
SIM_HANDLER(sim_do_modbus);
SIM_HANDLER(sim_do_udp_map);
SIM_HANDLER(sim_do_reports);
SIM_HANDLER(sim_do_security_status);
SIM_HANDLER(sim_do_authorise);
SIM_HANDLER(sim_do_password);
SIM_HANDLER(sim_do_save);
SIM_HANDLER(sim_do_reboot);
/* pins.c, pin_setup.c, counter.c, analog.c, pwm.c */
SIM_HANDLER(sim_do_pin_set);
SIM_HANDLER(sim_do_pin_get);
SIM_HANDLER(sim_do_pin_all);
SIM_HANDLER(sim_do_pin_caps);
SIM_HANDLER(sim_do_connection_signal);
SIM_HANDLER(sim_do_startup);
SIM_HANDLER(sim_do_input);
SIM_HANDLER(sim_do_inputs);
SIM_HANDLER(sim_do_output);
SIM_HANDLER(sim_do_outputs);
SIM_HANDLER(sim_do_io);
SIM_HANDLER(sim_do_counters);
SIM_HANDLER(sim_do_counter_dirs);
SIM_HANDLER(sim_do_counter_reset);
SIM_HANDLER(sim_do_analog_one);
SIM_HANDLER(sim_do_analog_packed);
SIM_HANDLER(sim_do_analog_filter);
SIM_HANDLER(sim_do_analog_all);
SIM_HANDLER(sim_do_analog_out);
SIM_HANDLER(sim_do_pwm);
SIM_HANDLER(sim_do_blip);
/* encoder_setup.c */
SIM_HANDLER(sim_do_encoder_set);
SIM_HANDLER(sim_do_encoder_get);
SIM_HANDLER(sim_do_encoder_raw);
SIM_HANDLER(sim_do_encoder_options);
SIM_HANDLER(sim_do_encoder_pins);
SIM_HANDLER(sim_do_encoder_values);
SIM_HANDLER(sim_do_fast_encoders);
SIM_HANDLER(sim_do_ultra_encoder);
/* keyboard.c, display.c, led.c */
SIM_HANDLER(sim_do_keyboard);
SIM_HANDLER(sim_do_lcd_setup);
SIM_HANDLER(sim_do_lcd);
SIM_HANDLER(sim_do_led_setup);
SIM_HANDLER(sim_do_led);
SIM_HANDLER(sim_do_strip);
/* poext.c, ponet.c, i2c.c, onewire.c, serial.c, can.c, sensor.c */
SIM_HANDLER(sim_do_poext);
SIM_HANDLER(sim_do_ponet);
SIM_HANDLER(sim_do_i2c);
SIM_HANDLER(sim_do_onewire);
SIM_HANDLER(sim_do_spi);
SIM_HANDLER(sim_do_uart);
SIM_HANDLER(sim_do_can);
SIM_HANDLER(sim_do_pocan);
SIM_HANDLER(sim_do_sensor_setup);
SIM_HANDLER(sim_do_sensor_values);
/* failsafe.c, clock.c, log.c, keep.c, poil.c */
SIM_HANDLER(sim_do_failsafe);
SIM_HANDLER(sim_do_clock);
SIM_HANDLER(sim_do_log);
SIM_HANDLER(sim_do_key_map);
SIM_HANDLER(sim_do_key_triggered);
SIM_HANDLER(sim_do_encoder_keys);
SIM_HANDLER(sim_do_typematic);
SIM_HANDLER(sim_do_servo);
SIM_HANDLER(sim_do_decoder);
SIM_HANDLER(sim_do_oem);
SIM_HANDLER(sim_do_poil);
/* engine_dispatch.c */
SIM_HANDLER(sim_do_engine);

/* One part of a fill which does not come as one datagram; only the last has a reply. */
SIM_HANDLER(sim_do_fill_part);

/* A multi-part fill of 512 bytes (section 1.6); fills in the one reply. */
enum sim_answer sim_do_multi_fill(struct sim_device *dev, const uint8_t *rq, uint8_t *rp);

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Network settings, server reports and being searched for (protocol sections 1.9, 1.10
 * and 3.23).
 *
 * The option byte stands at @28 of the request but at @27 of the reply, and
 * counts only with 0xA in its upper half. A write saves the configuration by
 * itself. What the settings say about addresses has no effect here: the
 * simulator stays where it was bound, as moving it would cut off the test.
 */
#include "sim/request.h"

#define OPTION_MARK 0xA0
#define OPTION_NO_DISCOVERY 0x01

void sim_network_defaults(struct sim_network_config *config, const uint8_t ip[4])
{
	static const uint8_t mask[4] = { 255, 255, 255, 0 };

	memcpy(config->fixed_ip, ip, 4);
	memcpy(config->gateway, ip, 3);
	config->gateway[3] = 1;
	memcpy(config->mask, mask, sizeof(mask));
	config->tcp_timeout = 30;
	wire_put_u16(config->modbus, 502);
	wire_put_u16(config->modbus + 2, 30);
}

static void take(struct sim_network_config *net, const uint8_t *rq)
{
	net->dhcp = rq[8];
	memcpy(net->fixed_ip, rq + 9, 4);
	net->tcp_timeout = wire_get_u16(rq + 17);
	if (rq[27] == 1) {
		memcpy(net->gateway, rq + 19, 4);
		memcpy(net->mask, rq + 23, 4);
	}
	if ((rq[28] & 0xF0) == OPTION_MARK)
		net->options = rq[28] & 0x07;
}

SIM_HANDLER(sim_do_network)
{
	struct sim_network_config *net = &dev->config.network;

	if (rq[P1] == 10 && !sim_locked(dev)) {
		take(net, rq);
		sim_device_save(dev);
	}
	rp[8] = net->dhcp;
	memcpy(rp + 9, net->fixed_ip, 4);
	memcpy(rp + 13, dev->options.ip, 4);
	wire_put_u16(rp + 17, net->tcp_timeout);
	memcpy(rp + 19, net->gateway, 4);
	memcpy(rp + 23, net->mask, 4);
	rp[27] = (uint8_t)(OPTION_MARK | net->options);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_modbus)
{
	struct sim_network_config *net = &dev->config.network;

	if (rq[P1] == 10 && !sim_locked(dev))
		memcpy(net->modbus, rq + 8, sizeof(net->modbus));
	memcpy(rp + 8, net->modbus, sizeof(net->modbus));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_udp_map)
{
	struct sim_network_config *net = &dev->config.network;

	if (rq[P1] == 1 && !sim_locked(dev))
		memcpy(net->udp_map, rq + 8, sizeof(net->udp_map));
	rp[P1] = rq[P1];
	memcpy(rp + 8, net->udp_map, sizeof(net->udp_map));
	return SIM_ANSWER;
}

/*
 * Where the device would send its values by itself, and how. Only kept: it makes
 * no report here, so the last answer of a server is 0 (protocol section 3.23).
 */
SIM_HANDLER(sim_do_reports)
{
	struct sim_network_config *net = &dev->config.network;
	unsigned int page = rq[P1] % 10;

	if (rq[P1] > 15 || page > 5)
		return SIM_ANSWER_UNKNOWN;
	rp[P1] = rq[P1];
	if (rq[P1] >= 10 && !sim_locked(dev)) {
		if (page) {
			memcpy(net->report_header[page - 1], rq + 8, 50);
		} else {
			memcpy(net->report, rq + 8, sizeof(net->report));
			memcpy(net->report_format, rq + 15, sizeof(net->report_format));
		}
	}
	if (page) {
		memcpy(rp + 8, net->report_header[page - 1], 50);
	} else {
		memcpy(rp + 8, net->report, sizeof(net->report));
		memcpy(rp + 17, net->report_format, 2);
	}
	return SIM_ANSWER;
}

size_t sim_device_discovery(struct sim_device *dev, uint64_t now_ns, const uint8_t asker[4],
			    uint8_t reply[SIM_DISCOVERY_MAX])
{
	const struct sim_device_options *own = &dev->options;
	bool old = own->hardware == WIRE_HW_56E;

	sim_device_advance(dev, now_ns);
	if (now_ns < dev->run.dead_until_ns || (dev->config.network.options & OPTION_NO_DISCOVERY))
		return 0;
	memset(reply, 0, SIM_DISCOVERY_MAX);
	reply[0] = dev->config.identity.user_id;
	if (old)
		wire_put_u16be(reply + 1, (uint16_t)own->serial);
	reply[3] = own->firmware_major;
	reply[4] = own->firmware_revision;
	memcpy(reply + 5, own->ip, 4);
	reply[9] = dev->config.network.dhcp;
	memcpy(reply + 10, asker, 4);
	if (old)
		return 14;
	wire_put_u32(reply + 14, own->serial);
	reply[18] = own->hardware;
	return 19;
}

// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PoIL, the device's own little processor (operation 0x82): its state and its
 * memories can be read and written; it runs no program, so it has one core, no
 * tasks, and nothing but time. Memories are 256 bytes each here; what lies
 * beyond reads 0. The register list (0x30) needs a
 * map which is not public.
 */
#include "sim/request.h"

#define MEMORIES 6
#define MEMORY_SIZE 256
#define READ_MOST 55
#define WRITE_MOST 54
#define IDLE_PERCENT 100

static void put_status(const struct sim_device *dev, uint8_t *rp)
{
	wire_put_u16(rp + 8, MEMORY_SIZE);
	wire_put_u16(rp + 10, MEMORY_SIZE);
	rp[12] = 1;
	wire_put_u16(rp + 13, dev->run.poil_state);
	rp[15] = dev->run.poil_debug;
	wire_put_u16(rp + 17, dev->run.poil_breakpoint);
	rp[59] = dev->run.poil_enabled;
}

static void read_memory(const struct sim_device *dev, unsigned int type, unsigned int address,
			unsigned int size, uint8_t *out)
{
	for (unsigned int i = 0; i < size; i++) {
		if (type < MEMORIES && address + i < MEMORY_SIZE)
			out[i] = dev->run.poil_memory[type][address + i];
	}
}

/*
 * Code goes to flash a page of 256 bytes at a time: it is put into the data
 * memory first, and a write of type 0 with no size and the page at 5 moves it
 * there, as the vendor library does. The code here has one page.
 */
static void write_page(struct sim_device *dev, unsigned int page)
{
	if (page == 0)
		memcpy(dev->run.poil_memory[0], dev->run.poil_memory[1], MEMORY_SIZE);
}

static void write_memory(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	unsigned int type = rq[P2];
	unsigned int address = wire_get_u16(rq + 4);
	unsigned int size = rq[8] > WRITE_MOST ? WRITE_MOST : rq[8];

	if (type >= MEMORIES || type == 2 || type == 3) {
		rp[P2] = 1;
		return;
	}
	if (type == 0 && size == 0)
		write_page(dev, rq[P4]);
	for (unsigned int i = 0; i < size && address + i < MEMORY_SIZE; i++)
		dev->run.poil_memory[type][address + i] = rq[9 + i];
}

/* Up to 18 chunks of address and size, their data back to back. */
static void monitor(const struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	unsigned int at = 0;

	for (unsigned int i = 0; i < 18; i++) {
		const uint8_t *entry = rq + 8 + 3 * i;
		unsigned int address = wire_get_u16(entry);

		if (address == 0xFFFF || at + entry[2] > READ_MOST)
			return;
		read_memory(dev, rq[P2], address, entry[2], rp + 8 + at);
		at += entry[2];
	}
}

SIM_HANDLER(sim_do_poil)
{
	rp[P1] = rq[P1];
	switch (rq[P1]) {
	case 0x00:
		put_status(dev, rp);
		break;
	case 0x01:
		dev->run.poil_state = wire_get_u16(rq + P2);
		put_status(dev, rp);
		break;
	case 0x02:
		dev->run.poil_state = 0;
		put_status(dev, rp);
		break;
	case 0x03:
		dev->run.poil_enabled = rq[P2];
		put_status(dev, rp);
		break;
	case 0x05:
		dev->run.poil_debug = rq[P2];
		dev->run.poil_breakpoint = wire_get_u16(rq + P3);
		put_status(dev, rp);
		break;
	case 0x06: /* the core in use: there is no other */
		break;
	case 0x10:
		read_memory(dev, rq[P2], wire_get_u16(rq + 4),
			    rq[8] > READ_MOST ? READ_MOST : rq[8], rp + 8);
		break;
	case 0x11:
		monitor(dev, rq, rp);
		break;
	case 0x15:
		write_memory(dev, rq, rp);
		break;
	case 0x16:
		if (rq[P2] < 2)
			memset(dev->run.poil_memory[rq[P2]], 0, MEMORY_SIZE);
		break;
	case 0x20:
		rp[P2] = IDLE_PERCENT;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}

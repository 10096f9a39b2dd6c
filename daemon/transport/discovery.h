/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Who is there? The search that PoKeys devices answer (protocol section 1.9).
 * Cold: for the control thread and the tools, never for the realtime thread.
 */
#ifndef TRANSPORT_DISCOVERY_H
#define TRANSPORT_DISCOVERY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "daemon/transport/addresses.h"
#include "daemon/transport/transport.h"

enum { DISCOVERY_UNHEARD = 8 };

/* An address of ours, and whether it was asked there. */
struct discovery_network {
	struct own_address own;
	int error; /* 0 = it was; -EOPNOTSUPP = no broadcasts; -errno */
};

/* What a search has done, for whoever has to say why nobody was found. */
struct discovery_report {
	uint16_t port; /* it was asked from there, UDP */
	int networks;  /* loopback is not among them */
	struct discovery_network network[ADDRESSES_OWN_MAX];
	bool overheard; /* whether replies were dropped here could be seen */
	/* Who replied, and a firewall of this computer dropped it; the first of them. */
	int unheard;
	uint32_t unheard_from[DISCOVERY_UNHEARD];
};

struct discovery_options {
	uint32_t timeout_ms;   /* how long answers are taken; 0 = 500 */
	uint16_t port;         /* 0 = 20055 */
	const char *interface; /* search on this one only, NULL = on all that are up */
	/* Asked besides the interfaces (an address across a router); port 0 = as above. */
	const struct transport_address *also;
	size_t also_count;
	struct discovery_report *report; /* filled in; NULL = not wanted */
	bool overhear;                   /* watch for dropped answers as well (CAP_NET_RAW) */
};

/*
 * One answer, as it came: unchecked, and a device that hears the question
 * twice answers twice. True = enough, end the search.
 */
typedef bool (*discovery_found_t)(void *context, const uint8_t *data, size_t length,
				  const struct transport_address *from);

/*
 * Ask, and hand out what is answered until the time is over. Returns the
 * number of answers; -ENETUNREACH if the question could not be sent to
 * anybody; -ENODEV for an interface that does not exist; -errno.
 */
int discovery_search(const struct discovery_options *options, discovery_found_t found,
		     void *context);

#endif
